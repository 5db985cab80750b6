// Numbers in words, and the picture of a colour scale.

/** Return a number with three digits that count. */
export function said(value) {
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  return String(Number(value.toFixed(Math.max(0, 2 - size))));
}

/** Draw the colour scale of strain energy into a canvas. */
export function drawRamp(canvas, stops) {
  const ink = canvas.getContext("2d");
  const gradient = ink.createLinearGradient(0, 0, canvas.width, 0);
  stops.forEach((stop, k) => {
    const color = stop.map((value) => Math.round(255 * value)).join(",");
    gradient.addColorStop(k / (stops.length - 1), `rgb(${color})`);
  });
  ink.fillStyle = gradient;
  ink.fillRect(0, 0, canvas.width, canvas.height);
}

/** Return the colour behind the model, red, green and blue from 0 to 1. */
export function paper(element) {
  const said = getComputedStyle(element).backgroundColor.match(/[\d.]+/g).map(Number);
  return said.slice(0, 3).map((value) => value / 255);
}

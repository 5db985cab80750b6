// A camera that turns about a point: by mouse, by one or two fingers, and by the keyboard.

import { PerspectiveCamera, Vector3 } from "three";

const FIELD = 26;
const ROOM = 1.22; // for the deformation and the arrows
const STEEPEST = 1.553;
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");

/** Fixed views: directions from the model to the eye, in LDraw's axes. */
export const VIEWS = {
  front: [0, 0, -1],
  side: [1, 0, 0],
  top: [0, -1, 0],
  iso: [0.577, -0.577, -0.577],
};

export class Orbit {
  /**
   * @param {HTMLElement} element what is dragged
   * @param {object} contents of the model: half extents, outermost points, usual view
   * @param {() => void} changed called when there is something new to draw
   */
  constructor(element, contents, changed) {
    const { half, extremes, toward, axes } = contents;
    // Angles are counted in LDraw's axes (x right, y down, z away); the model may have others.
    this.columns = [0, 1, 2].map((c) => new Vector3(axes[c], axes[3 + c], axes[6 + c]));
    this.up = this.columns[1].clone().negate();
    this.element = element;
    this.half = half;
    this.extremes = extremes.map((point) => new Vector3(...point));
    this.changed = changed;
    this.camera = new PerspectiveCamera(FIELD, 1, 1, 1000);
    this.target = new Vector3();
    this.flight = null;
    this.pointers = new Map();
    this.look(toward);
    this.distance = this.fitted();
    this.listen(element);
  }

  /** Turn the camera so that it looks from a direction, without moving its target. */
  look(toward) {
    const direction = new Vector3(...toward);
    const [x, y, z] = this.columns.map((column) => column.dot(direction));
    this.azimuth = Math.atan2(x, -z);
    this.elevation = Math.asin(Math.max(-1, Math.min(1, -y)));
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation));
  }

  /** Return a direction in LDraw's axes as one in those of the model. */
  turned([x, y, z]) {
    const [right, down, away] = this.columns;
    return new Vector3()
      .addScaledVector(right, x)
      .addScaledVector(down, y)
      .addScaledVector(away, z);
  }

  toward() {
    const level = Math.cos(this.elevation);
    return this.turned([
      Math.sin(this.azimuth) * level,
      -Math.sin(this.elevation),
      -Math.cos(this.azimuth) * level,
    ]);
  }

  /** Return the distance from which the whole model is seen, with room for its deformation. */
  fitted() {
    const toward = this.toward();
    const right = new Vector3().crossVectors(this.up, toward).normalize();
    const up = new Vector3().crossVectors(toward, right);
    const half = Math.tan((FIELD * Math.PI) / 360) / ROOM;
    const wide = half * Math.max(this.camera.aspect, 0.1);
    let distance = 0;
    for (const point of this.extremes) {
      const needed = Math.max(Math.abs(point.dot(up)) / half, Math.abs(point.dot(right)) / wide);
      distance = Math.max(distance, needed + point.dot(toward));
    }
    return distance;
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    if (!this.touched) this.distance = this.fitted();
  }

  apply() {
    const size = Math.hypot(...this.half);
    this.camera.position.copy(this.target).addScaledVector(this.toward(), this.distance);
    this.camera.up.copy(this.up);
    this.camera.lookAt(this.target);
    const off = this.camera.position.length();
    this.camera.near = Math.max(off - 2.5 * size, 0.002 * size);
    this.camera.far = off + 2.5 * size;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  turn(dx, dy) {
    this.touched = true;
    this.flight = null;
    this.azimuth += dx;
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation + dy));
    this.changed();
  }

  zoom(factor) {
    this.touched = true;
    this.flight = null;
    const size = Math.hypot(...this.half);
    this.distance = Math.max(0.08 * size, Math.min(12 * size, this.distance * factor));
    this.changed();
  }

  /** Move the target by pixels of the screen. */
  pan(dx, dy) {
    this.touched = true;
    const pixel =
      (2 * this.distance * Math.tan((FIELD * Math.PI) / 360)) / this.element.clientHeight;
    const toward = this.toward();
    const right = new Vector3().crossVectors(this.up, toward).normalize();
    const up = new Vector3().crossVectors(toward, right);
    this.target.addScaledVector(right, -dx * pixel).addScaledVector(up, dy * pixel);
    this.changed();
  }

  /** Fly to a point; at once when the reader wants things to keep still. */
  fly(point, distance) {
    this.touched = true;
    const end = { target: point.clone(), distance };
    if (STILL.matches) {
      this.target.copy(end.target);
      this.distance = end.distance;
    } else {
      this.flight = {
        from: { target: this.target.clone(), distance: this.distance },
        end,
        began: performance.now(),
      };
    }
    this.changed();
  }

  reset(toward) {
    this.look(toward);
    this.fly(new Vector3(), this.fitted());
    this.touched = false;
  }

  /** Go on with a flight; return whether it lasts. */
  step(now) {
    if (!this.flight) return false;
    const t = Math.min(1, (now - this.flight.began) / 550);
    const eased = t * t * (3 - 2 * t);
    const { from, end } = this.flight;
    this.target.lerpVectors(from.target, end.target, eased);
    this.distance = from.distance + (end.distance - from.distance) * eased;
    if (t >= 1) this.flight = null;
    return this.flight !== null;
  }

  /** Let an element turn the camera. */
  listen(element) {
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    element.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    // The wheel scrolls the page until the reader has clicked into the model.
    element.addEventListener(
      "wheel",
      (event) => {
        if (document.activeElement !== element && !event.ctrlKey) return;
        event.preventDefault();
        this.zoom(Math.exp(0.0012 * event.deltaY));
      },
      { passive: false },
    );
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("keydown", (event) => this.key(event));
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const gap = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
      this.zoom(gap(before) / gap(now));
      this.pan(dx / 2, dy / 2);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.pan(dx, dy);
    } else {
      this.turn(-0.008 * dx, 0.008 * dy);
    }
    this.pointers.set(event.pointerId, now);
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const moves = {
      ArrowLeft: () => (event.shiftKey ? this.pan(-30, 0) : this.turn(-0.12, 0)),
      ArrowRight: () => (event.shiftKey ? this.pan(30, 0) : this.turn(0.12, 0)),
      ArrowUp: () => (event.shiftKey ? this.pan(0, -30) : this.turn(0, 0.1)),
      ArrowDown: () => (event.shiftKey ? this.pan(0, 30) : this.turn(0, -0.1)),
      "+": () => this.zoom(0.85),
      "=": () => this.zoom(0.85),
      "-": () => this.zoom(1 / 0.85),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  }
}

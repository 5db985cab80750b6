// Before and after, side by side: one camera, one amount, one range of colours, one length of arrows.

import { Orbit, VIEWS } from "./orbit.js";
import { Stage } from "./stage.js";
import { drawRamp, paper, said } from "./words.js";

const PERIOD = 2.4; // seconds for one swing to and fro
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const SIDES = ["before", "after"];

const byId = (id) => document.getElementById(id);

/** One half of the picture: a canvas that can show one model after another. */
class Side {
  constructor(name) {
    this.canvas = byId(`canvas-${name}`);
    this.caption = byId(`caption-${name}`);
    this.stage = null;
    this.selected = -1;
  }

  show(model, range) {
    const renderer = this.stage?.renderer;
    this.stage?.dispose();
    this.model = model;
    this.stage = new Stage(this.canvas, model, renderer);
    this.stage.setEnergy(model.contents.work, range);
    this.selected = -1;
    this.caption.textContent = model.contents.caption;
  }

  /** Choose the worst case or the first motion; return what is chosen, null when there is none. */
  choose(kind) {
    const { modes, motions } = this.model.contents;
    this.movement = (kind === "mode" ? modes[0] : kind === "motion" ? motions[0] : null) ?? null;
    this.stage.setMovement(this.movement, this.movement ? kind : "none");
    this.stage.glyphs.forEach((glyph, k) => {
      if (glyph) glyph.visible = kind === "motion" && k === 0;
    });
  }

  fade(on) {
    const added = new Set(this.model.contents.added);
    const { data } = this.stage.state.image;
    const some = on && added.size > 0;
    for (let k = 0; k < this.model.parts.length; k++) {
      data[4 * k + 2] = some && !added.has(k) ? 255 : 0;
    }
    this.stage.state.needsUpdate = true;
  }

  select(part) {
    for (const k of [this.selected, part]) {
      if (k >= 0) this.stage.setState(k, true, k === part);
    }
    this.selected = part;
  }
}

export class Comparison {
  constructor(contents, open) {
    this.contents = contents;
    this.open = open;
    this.sides = SIDES.map((name) => new Side(name));
    this.playing = false;
    this.frame = this.frame.bind(this);
    this.orbit = new Orbit(this.sides[0].canvas, contents.frame, () => this.wake());
    this.orbit.listen(this.sides[1].canvas);
    this.sides[0].show(open(contents.models[0]), contents.most);
    this.amount = 1;
    byId("what").value = contents.begin;
    this.after(1);
    this.controls();
    drawRamp(byId("ramp"), contents.models[0].ramp);
    byId("heat-most").textContent = `${said(contents.most)} µJ`;
    byId("heat-middle").textContent = `${said(contents.most / 2)} µJ`;
    if (!STILL.matches) this.play(true);
    this.resize();
  }

  // --- drawing -----------------------------------------------------------------------------------

  wake() {
    if (!this.asked) this.asked = requestAnimationFrame(this.frame);
  }

  frame(now) {
    this.asked = 0;
    const flying = this.orbit.step(now);
    if (this.playing) {
      this.began ??= now;
      this.setAmount(Math.cos((2 * Math.PI * (now - this.began)) / 1000 / PERIOD));
    }
    this.orbit.apply();
    for (const { stage, canvas } of this.sides) {
      stage.draw(this.orbit.camera);
      canvas.dataset.drawn = String(Number(canvas.dataset.drawn ?? 0) + 1);
    }
    if (flying || this.playing) this.wake();
  }

  resize() {
    for (const { stage, canvas } of this.sides) {
      const { clientWidth, clientHeight } = canvas.parentElement;
      stage.renderer.setSize(clientWidth, clientHeight, false);
      stage.uniforms.uPaper.value.set(...paper(canvas.parentElement));
    }
    const { clientWidth, clientHeight } = this.sides[0].canvas.parentElement;
    this.orbit.resize(clientWidth, clientHeight);
    this.wake();
  }

  // --- what is shown -----------------------------------------------------------------------------

  /** Show a suggestion on the right. */
  after(number) {
    this.sides[1].show(this.open(this.contents.models[number]), this.contents.most);
    byId("which").value = String(number);
    for (const button of document.querySelectorAll("button.choose")) {
      const own = Number(button.dataset.after) === number;
      button.setAttribute("aria-pressed", String(own));
      button.closest("tr").classList.toggle("chosen", own);
    }
    byId("chosen").textContent = "";
    this.choose();
    this.resize();
  }

  choose() {
    const kind = byId("what").value;
    for (const side of this.sides) side.choose(kind);
    if (kind === "none") this.play(false);
    byId("play").disabled = byId("amount").disabled = kind === "none";
    this.applyChecks();
    this.setAmount(this.amount);
  }

  setAmount(amount) {
    this.amount = amount;
    const kind = byId("what").value;
    for (const { stage, movement } of this.sides) {
      const scale = kind === "mode" ? this.contents.scale : (movement?.scale ?? 0);
      stage.uniforms.uAmount.value = amount * scale;
    }
    byId("amount").value = String(Math.round(100 * amount));
    const words = {
      mode: `both under their worst load of 1 N, drawn × ${said(amount * this.contents.scale)}`,
      motion: `${Math.round(100 * amount)} % of the drawn swing`,
      none: "",
    }[kind];
    byId("amount").setAttribute("aria-valuetext", words);
    byId("scale-note").textContent = words;
    this.wake();
  }

  play(on) {
    this.playing = on && byId("what").value !== "none";
    this.began = null;
    byId("play").textContent = this.playing ? "Pause" : "Play";
    byId("play").setAttribute("aria-pressed", String(this.playing));
    this.wake();
  }

  applyChecks() {
    const checked = (id) => byId(id).checked;
    const worst = byId("what").value === "mode";
    byId("heat").hidden = !checked("by-energy");
    byId("load-key").hidden = !(worst && checked("show-load"));
    byId("motion-key").hidden = byId("what").value !== "motion";
    for (const side of this.sides) {
      const { stage } = side;
      side.fade(checked("by-new"));
      stage.uniforms.uByEnergy.value = checked("by-energy");
      for (const arrow of stage.load ?? []) arrow.visible = worst && checked("show-load");
      for (const line of stage.edges) line.visible = checked("show-edges");
      for (const line of stage.outlines) {
        line.visible = side.movement !== null && checked("show-outline");
      }
    }
    this.wake();
  }

  pick(side, event) {
    const box = side.canvas.getBoundingClientRect();
    const part = side.stage.pick(this.orbit.camera, event.clientX - box.left, event.clientY - box.top);
    for (const each of this.sides) each.select(each === side ? part : -1);
    const found = side.model.parts[part];
    byId("chosen").textContent = found
      ? [
          found.name,
          found.number && `part ${found.number}`,
          found.color,
          found.step ? `${found.submodel}, step ${found.step}, line ${found.line}` : "new",
          `${(100 * found.energy).toFixed(1)} % of the strain energy`,
        ]
          .filter(Boolean)
          .join(", ")
      : "";
    this.wake();
  }

  // --- controls ----------------------------------------------------------------------------------

  controls() {
    byId("viewer").classList.add("live");
    byId("which").addEventListener("change", (event) => this.after(Number(event.target.value)));
    byId("what").addEventListener("change", () => {
      this.choose();
      this.play(!STILL.matches);
    });
    byId("play").addEventListener("click", () => this.play(!this.playing));
    byId("amount").addEventListener("input", (event) => {
      this.play(false);
      this.setAmount(Number(event.target.value) / 100);
    });
    for (const id of ["by-new", "by-color", "by-energy", "show-load", "show-outline", "show-edges"]) {
      byId(id).addEventListener("change", () => this.applyChecks());
    }
    for (const button of document.querySelectorAll("button[data-view]")) {
      const view = VIEWS[button.dataset.view];
      const toward = view ? this.orbit.turned(view).toArray() : this.contents.frame.toward;
      button.addEventListener("click", () => this.orbit.reset(toward));
    }
    for (const button of document.querySelectorAll("button.choose")) {
      button.hidden = false;
      button.addEventListener("click", () => {
        this.after(Number(button.dataset.after));
        byId("stages").scrollIntoView({ block: "nearest", behavior: STILL.matches ? "auto" : "smooth" });
      });
    }
    for (const side of this.sides) this.listen(side);
    new ResizeObserver(() => this.resize()).observe(byId("stages"));
    DARK.addEventListener("change", () => this.resize());
    window.addEventListener("beforeprint", () => this.print());
  }

  listen(side) {
    let pressed = null;
    side.canvas.addEventListener("pointerdown", (event) => {
      pressed = [event.clientX, event.clientY];
    });
    side.canvas.addEventListener("click", (event) => {
      if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) <= 5) {
        this.pick(side, event);
      }
    });
    side.canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.key === " ") this.play(!this.playing);
      else if (event.key === "Home") this.orbit.reset(this.contents.frame.toward);
      else return;
      event.preventDefault();
    });
  }

  /** What the two halves show is what gets printed, when no picture was drawn. */
  print() {
    this.orbit.apply();
    this.sides.forEach((side, k) => {
      const picture = byId(`snapshot-${SIDES[k]}`);
      if (!picture) return;
      side.stage.draw(this.orbit.camera);
      picture.src = side.canvas.toDataURL("image/png");
      picture.hidden = false;
    });
  }
}

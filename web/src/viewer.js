// Connects the controls of the page with the stage.

import { Vector3 } from "three";
import { PartList } from "./list.js";
import { Marks } from "./marks.js";
import { Orbit, VIEWS } from "./orbit.js";
import { Stage } from "./stage.js";
import { drawRamp, paper, said } from "./words.js";

const PERIOD = 2.4; // seconds for one swing to and fro
const TURN = 4.0; // seconds for one full turn
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const DARK = window.matchMedia("(prefers-color-scheme: dark)");

const byId = (id) => document.getElementById(id);

export class Viewer {
  constructor(model) {
    this.model = model;
    this.canvas = byId("canvas");
    this.stage = new Stage(this.canvas, model);
    this.dirty = true;
    this.playing = false;
    this.selected = -1;
    this.orbit = new Orbit(this.canvas, model.contents, () => this.wake());
    this.marks = new Marks(byId("marks"), model.contents.spots, (spot) => this.chooseSpot(spot));
    this.list = new PartList(this);
    this.frame = this.frame.bind(this);
    this.controls();
    this.rows();
    this.legend();
    this.listen();
    this.choose(model.contents.modes.length ? "mode 0" : model.contents.motions.length ? "motion 0" : "none");
    this.setAmount(1);
    if (!STILL.matches && byId("what").value !== "none") this.play(true);
    this.resize();
  }

  // --- drawing -----------------------------------------------------------------------------------

  wake() {
    this.dirty = true;
    if (!this.asked) this.asked = requestAnimationFrame(this.frame);
  }

  frame(now) {
    this.asked = 0;
    const flying = this.orbit.step(now);
    if (this.playing) this.advance(now);
    this.orbit.apply();
    this.stage.draw(this.orbit.camera);
    this.marks.place(this.stage, this.orbit.camera, this.canvas.clientWidth, this.canvas.clientHeight);
    this.canvas.dataset.drawn = String(Number(this.canvas.dataset.drawn ?? 0) + 1);
    this.dirty = false;
    if (flying || this.playing) this.wake();
  }

  advance(now) {
    if (this.began === null) this.began = now;
    const t = (now - this.began) / 1000;
    const turns = this.movement && this.movement.turns;
    this.setAmount(turns ? ((t / TURN) % 1) * 2 - 1 : Math.cos((2 * Math.PI * t) / PERIOD));
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    this.stage.renderer.setSize(clientWidth, clientHeight, false);
    this.orbit.resize(clientWidth, clientHeight);
    this.stage.uniforms.uPaper.value.set(...paper(byId("stage")));
    this.wake();
  }

  // --- what moves --------------------------------------------------------------------------------

  choose(what) {
    const [kind, number] = what.split(" ");
    const lists = { mode: this.model.contents.modes, motion: this.model.contents.motions };
    this.kind = kind;
    this.number = Number(number ?? -1);
    this.movement = kind in lists ? lists[kind][this.number] : null;
    this.stage.setMovement(this.movement, kind);
    this.stage.glyphs.forEach((glyph, k) => {
      if (glyph) glyph.visible = kind === "motion" && k === this.number;
    });
    byId("what").value = what;
    byId("play").disabled = byId("amount").disabled = this.movement === null;
    if (!this.movement) this.play(false);
    for (const button of document.querySelectorAll("button.play-motion")) {
      const own = kind === "motion" && Number(button.dataset.motion) === this.number;
      button.setAttribute("aria-pressed", String(own));
    }
    this.applyChecks();
    this.setAmount(this.amount ?? 1);
  }

  setAmount(amount) {
    this.amount = amount;
    const scale = this.movement ? this.movement.scale : 0;
    const turns = this.movement && this.movement.turns;
    this.stage.uniforms.uAmount.value = turns ? ((amount + 1) / 2) * scale : amount * scale;
    byId("amount").value = String(Math.round(100 * amount));
    let words = "";
    if (this.kind === "mode") {
      words = `deformation at 1 N, drawn × ${said(amount * scale)}`;
      byId("amount").setAttribute("aria-valuetext", words);
    } else if (this.kind === "motion") {
      words = turns ? `${Math.round(180 * (amount + 1))}° of a turn` : `${Math.round(100 * amount)} % of the drawn swing`;
      byId("amount").setAttribute("aria-valuetext", words);
    }
    byId("scale-note").textContent = words;
    this.wake();
  }

  play(on) {
    this.playing = on && this.movement !== null;
    this.began = null;
    const button = byId("play");
    button.textContent = this.playing ? "Pause" : "Play";
    button.setAttribute("aria-pressed", String(this.playing));
    this.wake();
  }

  // --- parts -------------------------------------------------------------------------------------

  setShown(parts, shown) {
    for (const k of parts) this.stage.setState(k, shown, k === this.selected);
    byId("hidden-note").textContent = this.hiddenCount() ? `${this.hiddenCount()} parts hidden` : "";
    byId("show-all").disabled = this.hiddenCount() === 0;
    this.wake();
  }

  hiddenCount() {
    return this.model.parts.filter((part) => !this.stage.visible(part.index)).length;
  }

  select(part) {
    const before = this.selected;
    this.selected = part;
    for (const k of [before, part]) {
      if (k >= 0) this.stage.setState(k, this.stage.visible(k), k === part);
    }
    this.info();
    this.wake();
  }

  info() {
    const box = byId("info");
    box.hidden = this.selected < 0;
    if (box.hidden) return;
    const part = this.model.parts[this.selected];
    byId("info-name").textContent = part.name;
    const facts = {
      Part: part.number || "–",
      Colour: part.color || "–",
      [part.step ? "Submodel" : "Place"]: part.submodel,
      Step: part.step ? `${part.step} (line ${part.line} of the file)` : "–",
      "Strain energy": `${(100 * part.energy).toFixed(1)} % of the worst mode`,
    };
    if (part.standIn) facts.Shape = "not known: drawn as tubes";
    const list = byId("info-facts");
    list.replaceChildren();
    for (const [name, value] of Object.entries(facts)) {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = name;
      dd.textContent = value;
      list.append(dt, dd);
    }
  }

  flyTo(part, point) {
    if (!this.stage.visible(part)) this.setShown([part], true);
    this.select(part);
    this.orbit.fly(point ?? this.stage.centroid(part), 0.55 * this.orbit.fitted());
    byId("stage").scrollIntoView({ block: "nearest", behavior: STILL.matches ? "auto" : "smooth" });
  }

  chooseSpot(spot) {
    this.flyTo(spot.part, spot.point ? new Vector3(...spot.point) : undefined);
  }

  step(by) {
    const count = this.model.parts.length;
    let k = this.selected;
    for (let tries = 0; tries < count; tries++) {
      k = (((k < 0 && by < 0 ? 0 : k) + by) % count + count) % count;
      if (this.stage.visible(k)) break;
    }
    this.select(k);
  }

  // --- controls ----------------------------------------------------------------------------------

  applyChecks() {
    const checked = (id) => byId(id).checked;
    const energy = checked("by-energy");
    this.stage.uniforms.uByEnergy.value = energy;
    byId("heat").hidden = !energy;
    const worst = this.kind === "mode" && this.number === 0;
    if (this.stage.load) {
      for (const arrow of this.stage.load) arrow.visible = worst && checked("show-load");
    }
    byId("load-key").hidden = !(this.stage.load && worst && checked("show-load"));
    byId("motion-key").hidden = this.kind !== "motion";
    for (const line of this.stage.outlines) {
      line.visible = this.movement !== null && checked("show-outline");
    }
    for (const line of this.stage.edges) line.visible = checked("show-edges");
    this.marks.show(worst && checked("show-marks"));
    this.wake();
  }

  controls() {
    byId("viewer").classList.add("live");
    byId("what").addEventListener("change", (event) => {
      this.choose(event.target.value);
      this.play(!STILL.matches);
    });
    byId("play").addEventListener("click", () => this.play(!this.playing));
    byId("amount").addEventListener("input", (event) => {
      this.play(false);
      this.setAmount(Number(event.target.value) / 100);
    });
    for (const id of ["by-energy", "by-color", "show-load", "show-outline", "show-edges", "show-marks"]) {
      byId(id).addEventListener("change", () => this.applyChecks());
    }
    if (!this.stage.load) byId("show-load").disabled = byId("show-marks").disabled = true;
    if (!this.stage.edges.length) byId("show-edges").disabled = byId("show-outline").disabled = true;
    for (const [id, fasteners] of [["show-frame", false], ["show-fasteners", true]]) {
      byId(id).addEventListener("change", (event) => {
        const those = this.model.parts.filter((part) => part.fastener === fasteners);
        this.setShown(those.map((part) => part.index), event.target.checked);
        this.list.refresh();
      });
    }
    byId("show-all").addEventListener("click", () => this.showAll());
    byId("info-hide").addEventListener("click", () => {
      const part = this.selected;
      this.select(-1);
      this.setShown([part], false);
      this.list.refresh();
      this.canvas.focus();
    });
    byId("info-only").addEventListener("click", () => {
      this.setShown(this.model.parts.map((part) => part.index), false);
      this.setShown([this.selected], true);
      this.list.refresh();
    });
    byId("info-fly").addEventListener("click", () => this.flyTo(this.selected));
    byId("info-close").addEventListener("click", () => {
      this.select(-1);
      this.canvas.focus();
    });
    for (const button of document.querySelectorAll("button[data-view]")) {
      button.addEventListener("click", () => this.orbit.reset(this.view(button.dataset.view)));
    }
  }

  showAll() {
    this.setShown(this.model.parts.map((part) => part.index), true);
    byId("show-frame").checked = byId("show-fasteners").checked = true;
    this.list.refresh();
  }

  view(name) {
    return name in VIEWS ? this.orbit.turned(VIEWS[name]).toArray() : this.model.contents.toward;
  }

  rows() {
    for (const button of document.querySelectorAll("button.fly-spot")) {
      button.hidden = false;
      const spot = this.model.contents.spots[Number(button.dataset.spot)];
      const fly = () => this.chooseSpot(spot);
      button.addEventListener("click", (event) => {
        event.stopPropagation();
        fly();
      });
      button.closest("tr").addEventListener("click", fly);
      button.closest("tr").classList.add("flies");
    }
    for (const button of document.querySelectorAll("button.play-motion")) {
      button.hidden = false;
      button.addEventListener("click", () => {
        this.choose(`motion ${button.dataset.motion}`);
        this.play(true);
        byId("stage").scrollIntoView({ block: "nearest" });
      });
    }
  }

  legend() {
    drawRamp(byId("ramp"), this.model.contents.ramp);
    byId("heat-most").textContent = `${said(100 * this.stage.most)} %`;
    byId("heat-middle").textContent = `${said(50 * this.stage.most)} %`;
  }

  listen() {
    let pressed = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      pressed = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener("click", (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 5) return;
      const box = this.canvas.getBoundingClientRect();
      this.select(this.stage.pick(this.orbit.camera, event.clientX - box.left, event.clientY - box.top));
    });
    this.canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const keys = {
        n: () => this.step(1),
        p: () => this.step(-1),
        f: () => this.selected >= 0 && this.flyTo(this.selected),
        h: () => this.selected >= 0 && byId("info-hide").click(),
        Escape: () => this.select(-1),
        " ": () => this.play(!this.playing),
        Home: () => this.orbit.reset(this.model.contents.toward),
      };
      const action = keys[event.key];
      if (!action) return;
      event.preventDefault();
      action();
    });
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
    DARK.addEventListener("change", () => this.resize());
    window.addEventListener("beforeprint", () => this.print());
  }

  /** Without a drawn picture the view of the model is what gets printed. */
  print() {
    const picture = byId("snapshot");
    if (!picture) return;
    this.orbit.apply();
    this.stage.draw(this.orbit.camera);
    picture.src = this.canvas.toDataURL("image/png");
    picture.hidden = false;
  }
}

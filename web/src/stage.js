// Draws the model: parts, edges, outline, arrows; finds the part under a pixel.

import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  DoubleSide,
  FloatType,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LineSegments,
  Mesh,
  NearestFilter,
  RGBAFormat,
  RawShaderMaterial,
  Scene,
  UnsignedByteType,
  Vector3,
  WebGLRenderTarget,
  WebGLRenderer,
} from "three";
import { unpackEdges, unpackFaces } from "./data.js";
import * as shaders from "./shaders.js";

const LOAD = [0.96, 0.49, 0.0];
const MOTION = [0.05, 0.62, 0.24];

function dataTexture(texels, type) {
  const rows = Math.max(1, Math.ceil(texels / shaders.ROW));
  const values =
    type === FloatType
      ? new Float32Array(4 * shaders.ROW * rows)
      : new Uint8Array(4 * shaders.ROW * rows);
  const texture = new DataTexture(values, shaders.ROW, rows, RGBAFormat, type);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** Return an arrow along z: round shaft and head, `length` long. */
function arrowTriangles(radius, length) {
  const sides = 10;
  const r = Math.min(radius, length / 9);
  const neck = length - 5.5 * r;
  const rings = [
    [r, 0],
    [r, neck],
    [2.6 * r, neck],
    [0, length],
  ];
  const points = [];
  for (const [size, z] of rings) {
    for (let k = 0; k < sides; k++) {
      const angle = (2 * Math.PI * k) / sides;
      points.push(size * Math.cos(angle), size * Math.sin(angle), z);
    }
  }
  const faces = [];
  for (let ring = 0; ring < rings.length - 1; ring++) {
    for (let k = 0; k < sides; k++) {
      const a = ring * sides + k;
      const b = ring * sides + ((k + 1) % sides);
      faces.push(a, b, b + sides, a, b + sides, a + sides);
    }
  }
  return { points, faces };
}

export class Stage {
  constructor(canvas, model, renderer) {
    this.model = model;
    this.canvas = canvas;
    const { contents, array } = model;
    this.renderer = renderer ?? new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, contents.light ? 1.25 : 2));
    this.scene = new Scene();
    this.pickScene = new Scene();
    this.pickTarget = new WebGLRenderTarget(1, 1);
    this.centroids = array(contents.centroids);
    this.twists = new Float32Array(6 * contents.count);
    this.fixed = dataTexture(contents.count * shaders.FIXED, FloatType);
    this.moved = dataTexture(contents.count * shaders.MOVED, FloatType);
    this.state = dataTexture(contents.count, UnsignedByteType);
    this.fillFixed();
    for (let k = 0; k < contents.count; k++) this.state.image.data[4 * k] = 255;
    const energies = array(contents.energy);
    this.most = energies.reduce((most, value) => Math.max(most, value), 0);
    this.uniforms = {
      uFixed: { value: this.fixed },
      uMoved: { value: this.moved },
      uState: { value: this.state },
      uAmount: { value: 0 },
      uBends: { value: false },
      uScrew: { value: false },
      uByEnergy: { value: false },
      uFade: { value: false },
      uMost: { value: this.most },
      uRamp: { value: contents.ramp.map((stop) => new Vector3(...stop)) },
      uPaper: { value: new Vector3(1, 1, 1) },
    };
    this.edges = [];
    this.outlines = [];
    this.addShapes();
    this.addLoad();
    this.addGlyphs();
  }

  fillFixed() {
    const { contents, array } = this.model;
    const [rotations, translations] = [array(contents.rotations), array(contents.translations)];
    const [inner, colors] = [array(contents.inner), array(contents.colors)];
    const energies = array(contents.energy);
    const data = this.fixed.image.data;
    for (let k = 0; k < contents.count; k++) {
      const at = 4 * shaders.FIXED * k;
      for (let row = 0; row < 3; row++) {
        for (let c = 0; c < 3; c++) data[at + 4 * row + c] = rotations[9 * k + 3 * row + c];
        data[at + 4 * row + 3] = translations[3 * k + row];
        data[at + 12 + row] = this.centroids[3 * k + row];
        data[at + 16 + row] = inner[3 * k + row];
      }
      for (let c = 0; c < 4; c++) data[at + 20 + c] = colors[4 * k + c] / 255;
      data[at + 15] = 1;
      data[at + 19] = energies[k];
    }
  }

  material(vertexShader, fragmentShader, uniforms, options = {}) {
    return new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      uniforms,
      side: DoubleSide,
      ...options,
    });
  }

  add(thing, scene = this.scene) {
    thing.frustumCulled = false;
    scene.add(thing);
    return thing;
  }

  addShapes() {
    const { contents, array } = this.model;
    const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const part = (options) =>
      this.material(shaders.PART_VERTEX, shaders.PART_FRAGMENT, this.uniforms, options);
    const solid = part(offset);
    // Glass-like parts come after all others.
    const glass = part({ ...offset, transparent: true });
    const colors = array(contents.colors);
    const clear = (k) => colors[4 * k + 3] < 255;
    const pick = this.material(shaders.PICK_VERTEX, shaders.PICK_FRAGMENT, this.uniforms);
    const lines = (ink, opacity, amount) =>
      this.material(
        shaders.LINE_VERTEX,
        shaders.LINE_FRAGMENT,
        {
          ...this.uniforms,
          ...(amount ?? {}),
          uInk: { value: new Vector3(...ink) },
          uOpacity: { value: opacity },
          uLift: { value: 0.0004 },
        },
        { transparent: opacity < 1, depthWrite: opacity === 1 },
      );
    const edge = lines([-1, 0, 0], 1);
    this.outlineMaterial = lines([0.5, 0.53, 0.56], contents.count < 60 ? 0.6 : 0.28, {
      uAmount: { value: 0 },
    });
    for (const shape of contents.shapes) {
      const own = Float32Array.from(array(shape.parts));
      const members = new InstancedBufferAttribute(own, 1);
      const points = new BufferAttribute(array(shape.points), 3);
      const geometry = (indices, members) => {
        const made = new InstancedBufferGeometry();
        made.setAttribute("position", points);
        made.setAttribute("part", members);
        made.setIndex(new BufferAttribute(indices, 1));
        made.instanceCount = members.count;
        return made;
      };
      const corners = unpackFaces(array(shape.faces));
      for (const [material, those] of [
        [solid, own.filter((k) => !clear(k))],
        [glass, own.filter(clear)],
      ]) {
        if (those.length === 0) continue;
        this.add(new Mesh(geometry(corners, new InstancedBufferAttribute(those, 1)), material));
      }
      this.add(new Mesh(geometry(corners, members), pick), this.pickScene);
      if (shape.edges.length === 0) continue;
      const segments = geometry(unpackEdges(corners, array(shape.edges)), members);
      this.edges.push(this.add(new LineSegments(segments, edge)));
      const outline = this.add(new LineSegments(segments, this.outlineMaterial));
      outline.visible = false;
      this.outlines.push(outline);
    }
  }

  addLoad() {
    const { contents, array } = this.model;
    this.load = null;
    if (!contents.load) return;
    const vectors = array(contents.load.vectors);
    const uniforms = { uAmount: this.uniforms.uAmount, uColor: { value: new Vector3(...LOAD) } };
    const material = this.material(shaders.ARROW_VERTEX, shaders.ARROW_FRAGMENT, uniforms);
    const [starts, ways] = [array(contents.load.points), array(contents.load.ways)];
    this.load = [];
    for (let k = 0; k < vectors.length / 3; k++) {
      const vector = vectors.subarray(3 * k, 3 * k + 3);
      const { points, faces } = arrowTriangles(contents.load.radius, Math.hypot(...vector));
      const geometry = new InstancedBufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
      geometry.setIndex(faces);
      const one = (values) => new InstancedBufferAttribute(values.slice(3 * k, 3 * k + 3), 3);
      geometry.setAttribute("start", one(starts));
      geometry.setAttribute("way", one(ways));
      geometry.setAttribute("vector", one(vectors));
      geometry.instanceCount = 1;
      const arrow = this.add(new Mesh(geometry, material));
      arrow.renderOrder = 10;
      this.load.push(arrow);
    }
  }

  addGlyphs() {
    const { contents, array } = this.model;
    const uniforms = { uColor: { value: new Vector3(...MOTION) } };
    const material = this.material(shaders.GLYPH_VERTEX, shaders.ARROW_FRAGMENT, uniforms);
    this.glyphs = contents.motions.map((motion) => {
      if (!motion.arrows) return null;
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(array(motion.arrows.points), 3));
      geometry.setIndex(new BufferAttribute(array(motion.arrows.faces), 1));
      const glyph = this.add(new Mesh(geometry, material));
      glyph.renderOrder = 11;
      glyph.visible = false;
      return glyph;
    });
  }

  /** Choose the movement that the amount scales: a mode, a motion, or none. */
  setMovement(movement, kind) {
    const { contents, array } = this.model;
    const data = this.moved.image.data.fill(0);
    const fixed = this.fixed.image.data;
    this.twists.fill(0);
    if (movement) {
      this.twists.set(array(movement.twists));
      const bending = movement.bending ? array(movement.bending) : null;
      const sizes = movement.bending ? array(movement.sizes) : null;
      for (let k = 0; k < contents.count; k++) {
        const at = 4 * shaders.MOVED * k;
        for (let c = 0; c < 3; c++) {
          data[at + c] = this.twists[6 * k + c];
          data[at + 4 + c] = this.twists[6 * k + 3 + c];
        }
        if (bending) {
          for (let c = 0; c < 60; c++) data[at + 8 + c] = movement.unit * bending[60 * k + c];
          fixed[4 * shaders.FIXED * k + 15] = sizes[k];
        }
      }
      if (kind === "motion") {
        for (const k of array(movement.parts)) data[4 * shaders.MOVED * k + 3] = 1;
      }
    }
    this.moved.needsUpdate = true;
    this.fixed.needsUpdate = true;
    this.uniforms.uBends.value = Boolean(movement && movement.bending);
    this.uniforms.uScrew.value = kind === "motion";
    this.uniforms.uFade.value = kind === "motion";
  }

  /** Colour by energy: what a part's share stands for, and what the darkest colour stands for. */
  setEnergy(whole, most) {
    const { contents, array } = this.model;
    array(contents.energy).forEach((share, k) => {
      this.fixed.image.data[4 * shaders.FIXED * k + 19] = whole * share;
    });
    this.fixed.needsUpdate = true;
    this.uniforms.uMost.value = most;
  }

  /** Give back what the graphics card holds; the renderer stays. */
  dispose() {
    for (const scene of [this.scene, this.pickScene]) {
      scene.traverse((thing) => {
        thing.geometry?.dispose();
        thing.material?.dispose();
      });
    }
    for (const texture of [this.fixed, this.moved, this.state, this.pickTarget]) texture.dispose();
  }

  setState(part, visible, selected) {
    this.state.image.data[4 * part] = visible ? 255 : 0;
    this.state.image.data[4 * part + 1] = selected ? 255 : 0;
    this.state.needsUpdate = true;
  }

  visible(part) {
    return this.state.image.data[4 * part] > 0;
  }

  centroid(part) {
    return new Vector3().fromArray(this.centroids, 3 * part);
  }

  /** Return where a point of a part is drawn, its rotation taken as small. */
  moving(part, point) {
    const amount = this.uniforms.uAmount.value;
    const move = new Vector3().fromArray(this.twists, 6 * part);
    const turn = new Vector3().fromArray(this.twists, 6 * part + 3);
    const arm = point.clone().sub(this.centroid(part));
    return point.clone().addScaledVector(move.add(turn.cross(arm)), amount);
  }

  draw(camera) {
    this.renderer.render(this.scene, camera);
  }

  /** Return the number of the part at a pixel of the canvas, or -1. */
  pick(camera, x, y) {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    camera.setViewOffset(width, height, Math.floor(x), Math.floor(y), 1, 1);
    this.renderer.setRenderTarget(this.pickTarget);
    this.renderer.setClearColor(0x000000, 0);
    this.renderer.clear();
    this.renderer.render(this.pickScene, camera);
    const pixel = new Uint8Array(4);
    this.renderer.readRenderTargetPixels(this.pickTarget, 0, 0, 1, 1, pixel);
    this.renderer.setRenderTarget(null);
    camera.clearViewOffset();
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
  }
}

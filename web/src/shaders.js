// One vertex program moves every part: rigidly by its twist, and bent by its polynomial. What belongs
// to a part lies in textures, so that all parts of a type are drawn in one call.

/** Texels in a row of the data textures. */
export const ROW = 1024;
/** Texels per part: what never changes, and what the chosen movement does. */
export const FIXED = 6;
export const MOVED = 17;

/** Stops of the colour scale of strain energy; the page brings the colours. */
export const STOPS = 5;

const MOVEMENT = `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform sampler2D uFixed, uMoved, uState;
uniform float uAmount;
uniform bool uBends, uScrew;
in vec3 position;
in float part;

vec4 texel(sampler2D data, int at) {
  return texelFetch(data, ivec2(at % ${ROW}, at / ${ROW}), 0);
}
vec4 fixedOf(int i, int k) { return texel(uFixed, i * ${FIXED} + k); }
vec4 movedOf(int i, int k) { return texel(uMoved, i * ${MOVED} + k); }

float coefficient(int i, int k) {
  vec4 four = movedOf(i, 2 + k / 4);
  return four[k % 4];
}
vec3 term(int i, int k) {
  return vec3(coefficient(i, 3 * k), coefficient(i, 3 * k + 1), coefficient(i, 3 * k + 2));
}
vec3 bending(int i, vec3 q) {
  float x = q.x, y = q.y, z = q.z;
  float powers[20] = float[20](
    1.0, x, y, z,
    x * x, x * y, x * z, y * y, y * z, z * z,
    x * x * x, x * x * y, x * x * z, x * y * y, x * y * z, x * z * z,
    y * y * y, y * y * z, y * z * z, z * z * z);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 20; k++) sum += powers[k] * term(i, k);
  return sum;
}

// Where a point of part i is drawn. Rotations are finite, or parts would swell.
vec3 placed(int i, vec3 local) {
  vec4 a = fixedOf(i, 0), b = fixedOf(i, 1), c = fixedOf(i, 2), d = fixedOf(i, 3);
  vec3 world = vec3(dot(a.xyz, local), dot(b.xyz, local), dot(c.xyz, local)) + vec3(a.w, b.w, c.w);
  vec3 move = uAmount * movedOf(i, 0).xyz;
  vec3 turn = uAmount * movedOf(i, 1).xyz;
  vec3 bent = vec3(0.0);
  if (uBends) bent = uAmount * bending(i, (local - fixedOf(i, 4).xyz) / d.w);
  float angle = length(turn);
  vec3 arm = world - d.xyz;
  if (angle > 1e-9) {
    vec3 k = turn / angle;
    arm = arm * cos(angle) + cross(k, arm) * sin(angle) + k * dot(k, arm) * (1.0 - cos(angle));
    // A motion goes along a screw; a deformation keeps its straight way.
    if (uScrew) {
      float along = sin(angle) / angle, aside = (1.0 - cos(angle)) / angle;
      move = along * move + aside * cross(k, move) + (1.0 - along) * dot(k, move) * k;
    }
  }
  return d.xyz + arm + move + bent;
}
`;

export const PART_VERTEX = `${MOVEMENT}
uniform bool uByEnergy, uFade;
uniform float uMost;
uniform vec3 uRamp[${STOPS}];
uniform vec3 uPaper;
out vec3 vView;
flat out vec4 vColor;

vec3 heat(float share) {
  float at = clamp(share, 0.0, 1.0) * float(${STOPS - 1});
  int low = min(int(floor(at)), ${STOPS - 2});
  return mix(uRamp[low], uRamp[low + 1], at - float(low));
}

void main() {
  int i = int(part + 0.5);
  vec4 state = texel(uState, i);
  vec4 own = fixedOf(i, 5);
  vec3 ink = uByEnergy ? heat(fixedOf(i, 4).w / max(uMost, 1e-9)) : own.rgb;
  if (uFade) {
    bool moves = movedOf(i, 0).w > 0.5;
    ink = moves ? mix(ink, vec3(0.05, 0.68, 0.26), 0.72) : mix(ink, uPaper, 0.55);
  }
  if (state.b > 0.5) ink = mix(ink, uPaper, 0.6);
  if (state.g > 0.5) ink = mix(ink, vec3(0.0, 0.55, 1.0), 0.65);
  vColor = vec4(ink, uByEnergy ? 1.0 : own.a);
  vec4 seen = modelViewMatrix * vec4(placed(i, position), 1.0);
  vView = seen.xyz;
  gl_Position = state.r > 0.5 ? projectionMatrix * seen : vec4(0.0, 0.0, 2.0, 1.0);
}
`;

export const PART_FRAGMENT = `
precision highp float;
in vec3 vView;
flat in vec4 vColor;
out vec4 color;
void main() {
  vec3 normal = normalize(cross(dFdx(vView), dFdy(vView)));
  if (dot(normal, vView) > 0.0) normal = -normal;
  float eye = abs(dot(normal, normalize(vView)));
  float above = max(dot(normal, normalize(vec3(-0.5, 0.8, 0.35))), 0.0);
  vec3 lit = min(vColor.rgb * (0.46 + 0.36 * eye + 0.34 * above) + 0.015, 1.0);
  color = vec4(lit, vColor.a);
}
`;

export const LINE_VERTEX = `${MOVEMENT}
uniform bool uFade, uByEnergy;
uniform vec3 uPaper, uInk;
uniform float uLift;
flat out vec3 vColor;
void main() {
  int i = int(part + 0.5);
  vec4 state = texel(uState, i);
  vec3 own = uByEnergy ? vec3(0.6) : fixedOf(i, 5).rgb;
  float light = dot(own, vec3(0.3, 0.6, 0.1));
  vColor = uInk.x >= 0.0 ? uInk : (light < 0.18 ? vec3(0.5, 0.53, 0.55) : vec3(0.12, 0.13, 0.14));
  if ((uFade && movedOf(i, 0).w < 0.5) || state.b > 0.5) vColor = mix(vColor, uPaper, 0.6);
  vec4 seen = modelViewMatrix * vec4(placed(i, position), 1.0);
  seen.xyz *= 1.0 - uLift;
  gl_Position = state.r > 0.5 ? projectionMatrix * seen : vec4(0.0, 0.0, 2.0, 1.0);
}
`;

export const LINE_FRAGMENT = `
precision highp float;
uniform float uOpacity;
flat in vec3 vColor;
out vec4 color;
void main() { color = vec4(vColor, uOpacity); }
`;

export const PICK_VERTEX = `${MOVEMENT}
flat out vec3 vColor;
void main() {
  int i = int(part + 0.5);
  int code = i + 1;
  vColor = vec3(float(code & 255), float((code >> 8) & 255), float((code >> 16) & 255)) / 255.0;
  gl_Position = texel(uState, i).r > 0.5
    ? projectionMatrix * modelViewMatrix * vec4(placed(i, position), 1.0)
    : vec4(0.0, 0.0, 2.0, 1.0);
}
`;

export const PICK_FRAGMENT = `
precision highp float;
flat in vec3 vColor;
out vec4 color;
void main() { color = vec4(vColor, 1.0); }
`;

// Arrows lie in the nearest hundredth of the depth range: over all parts, and right among themselves.
const ON_TOP = "gl_Position.z = (gl_Position.z / gl_Position.w * 0.01 - 0.985) * gl_Position.w;";

export const ARROW_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform float uAmount;
in vec3 position, start, way, vector;
out vec3 vView;
void main() {
  vec3 along = normalize(vector);
  vec3 helper = abs(along.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
  vec3 side = normalize(cross(helper, along));
  vec3 other = cross(along, side);
  vec3 p = start + uAmount * way + position.x * side + position.y * other + position.z * along;
  vec4 seen = modelViewMatrix * vec4(p, 1.0);
  vView = seen.xyz;
  gl_Position = projectionMatrix * seen;
  ${ON_TOP}
}
`;

export const GLYPH_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
out vec3 vView;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  vView = seen.xyz;
  gl_Position = projectionMatrix * seen;
  ${ON_TOP}
}
`;

export const ARROW_FRAGMENT = `
precision highp float;
uniform vec3 uColor;
in vec3 vView;
out vec4 color;
void main() {
  vec3 normal = normalize(cross(dFdx(vView), dFdy(vView)));
  color = vec4(uColor * (0.62 + 0.38 * abs(dot(normal, normalize(vView)))), 1.0);
}
`;

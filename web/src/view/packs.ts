// Packs: how thousands of bodies are drawn in a few calls.
//
// A geometry is repeated in one buffer, so that one instance of it draws a pack of bodies rather than one body. Software GL
// takes a draw call's time for each instance, about 18 us, and graphics cards fill their vector units badly with instances
// of a few vertices. Each vertex knows its number in the pack; `places` says which slot of Bodies that is, a row for each
// pack, and the vertex shader reads the pose and the colour of that slot. So a picture costs one upload of all poses, and a
// body moves from one geometry to another by a change of one number.

import * as THREE from 'three';
import { POSE_PARTS } from '../world/bodies.ts';

const ROW = 64; // bodies in a row of the textures of poses and colours
const MOST_BODIES = 64; // in a pack
const MOST_VERTICES = 4096; // in a pack: beyond that an instance costs little beside its vertices
const NOBODY = 0xffffffff;
const FIRST_ROWS = 4;

const POSED = `
uniform highp sampler2D poses;
uniform highp usampler2D places;
uniform sampler2D colours;
attribute float body;
vec3 bodyPlace;
vec4 bodyTurn;
vec3 bodyColour;
vec3 turned(vec3 v) {
  vec3 across = 2.0 * cross(bodyTurn.xyz, v);
  return v + bodyTurn.w * across + cross(bodyTurn.xyz, across);
}
// False: the pack has no such body, which has to vanish.
bool readBody() {
  uint slot = texelFetch(places, ivec2(int(body), gl_InstanceID), 0).r;
  if (slot == ${NOBODY}u) return false;
  ivec2 at = ivec2(int(slot & ${ROW - 1}u), int(slot / ${ROW}u));
  bodyPlace = texelFetch(poses, ivec2(2 * at.x, at.y), 0).xyz;
  bodyTurn = texelFetch(poses, ivec2(2 * at.x + 1, at.y), 0);
  bodyColour = texelFetch(colours, at, 0).rgb;
  return true;
}`;

// For shaders of our own: \`readBody()\`, then \`turned\`, \`bodyPlace\` and \`bodyColour\`.
export const PACK_VERTEX_HEAD = POSED;

// For shaders of three.js, which take a body for an instance with a matrix and a colour.
const AS_INSTANCE_HEAD = `
#define USE_INSTANCING
#define USE_INSTANCING_COLOR
mat4 instanceMatrix;
vec3 instanceColor;
${POSED}
void makeInstance() {
  instanceMatrix = mat4(0.0);
  instanceMatrix[3] = vec4(0.0, 0.0, 0.0, 1.0);
  if (!readBody()) return;
  instanceMatrix = mat4(vec4(turned(vec3(1.0, 0.0, 0.0)), 0.0), vec4(turned(vec3(0.0, 1.0, 0.0)), 0.0), vec4(turned(vec3(0.0, 0.0, 1.0)), 0.0), vec4(bodyPlace, 1.0));
  instanceColor = bodyColour;
}`;

export interface PackUniforms {
  poses: { value: THREE.DataTexture };
  colours: { value: THREE.DataTexture };
  places: { value: THREE.DataTexture };
}

// Has a material of three.js draw packs. Materials of one `kind` share their program.
export function drawsPacks(material: THREE.Material, kind: string, uniforms: PackUniforms): void {
  const before = material.onBeforeCompile;
  material.onBeforeCompile = (shader, renderer) => {
    before.call(material, shader, renderer);
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = `${AS_INSTANCE_HEAD}\n${shader.vertexShader.replace('void main() {', 'void main() {\n  makeInstance();')}`;
    shader.fragmentShader = `#define USE_COLOR\n${shader.fragmentShader}`;
  };
  material.customProgramCacheKey = () => `packs ${kind}`;
}

// Poses and colours of all bodies, by slot.
export class BodyTextures {
  readonly poses = { value: poseTexture(new Float32Array(POSE_PARTS * ROW), 1) };
  readonly colours = { value: colourTexture(new Uint8Array(4 * ROW), 1) };
  private rows = 1;

  // Has room for slots below this, of at most so many.
  reserve(slots: number, capacity: number, poses: Float32Array): void {
    if (slots <= ROW * this.rows) return;
    // A picture uploads all rows, so there are few more of them than are needed.
    while (slots > ROW * this.rows) this.rows = Math.min(Math.ceil(1.25 * this.rows), Math.ceil(capacity / ROW));
    const colours = new Uint8Array(4 * ROW * this.rows);
    colours.set(this.colours.value.image.data as Uint8Array);
    this.poses.value.dispose();
    this.colours.value.dispose();
    this.poses.value = poseTexture(this.cut(poses), this.rows);
    this.colours.value = colourTexture(colours, this.rows);
  }

  // The picture shows these poses from now on.
  show(poses: Float32Array): void {
    this.poses.value.image.data = this.cut(poses);
    this.poses.value.needsUpdate = true;
  }

  // Linear red, green and blue.
  setColour(slot: number, red: number, green: number, blue: number): void {
    const data = this.colours.value.image.data as Uint8Array;
    data[4 * slot] = SRGB[(red * STEPS) | 0]!;
    data[4 * slot + 1] = SRGB[(green * STEPS) | 0]!;
    data[4 * slot + 2] = SRGB[(blue * STEPS) | 0]!;
    this.colours.value.needsUpdate = true;
  }

  colour(slot: number): number[] {
    const data = this.colours.value.image.data as Uint8Array;
    return new THREE.Color().setRGB(data[4 * slot]! / 255, data[4 * slot + 1]! / 255, data[4 * slot + 2]! / 255, THREE.SRGBColorSpace).toArray();
  }

  // Exactly as many as the texture has.
  private cut(poses: Float32Array): Float32Array {
    const length = POSE_PARTS * ROW * this.rows;
    if (poses.length >= length) return poses.subarray(0, length);
    const longer = new Float32Array(length);
    longer.set(poses);
    return longer;
  }
}

const STEPS = 4095;
const SRGB = Uint8Array.from({ length: STEPS + 1 }, (_, step) => Math.round(255 * new THREE.Color(step / STEPS, 0, 0).convertLinearToSRGB().r));

function poseTexture(data: Float32Array, rows: number): THREE.DataTexture {
  const texture = new THREE.DataTexture(data, 2 * ROW, rows, THREE.RGBAFormat, THREE.FloatType);
  texture.needsUpdate = true;
  return texture;
}

function colourTexture(data: Uint8Array, rows: number): THREE.DataTexture {
  const texture = new THREE.DataTexture(data, ROW, rows);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}

// The bodies that are drawn by one geometry.
export class Pack {
  readonly places = { value: placeTexture(new Uint32Array(1), 1, 1) };
  readonly mesh: THREE.Mesh<THREE.InstancedBufferGeometry>;
  count = 0;
  private readonly copies: number;

  // The geometry stays its maker's. It may have none, one or many bodies, and is drawn by the material that `made` returns.
  constructor(geometry: THREE.BufferGeometry, made: (places: { value: THREE.DataTexture }) => THREE.Material) {
    const vertices = Math.max(1, geometry.getAttribute('position')?.count ?? 1);
    this.copies = Math.min(MOST_BODIES, Math.max(1, Math.floor(MOST_VERTICES / vertices)));
    this.mesh = new THREE.Mesh(repeated(geometry, this.copies), made(this.places));
    this.mesh.frustumCulled = false; // its bodies are everywhere
    this.mesh.matrixAutoUpdate = false;
    this.mesh.visible = false;
    this.resize(FIRST_ROWS);
  }

  // Its place among the bodies of this pack.
  add(slot: number): number {
    const at = this.count++;
    if (at === this.slots.length) this.resize(2 * this.places.value.image.height);
    this.set(at, slot);
    return at;
  }

  // The slot of the body that has this place now, or -1.
  remove(at: number): number {
    const last = --this.count;
    const moved = last === at ? -1 : this.slots[last]!;
    if (moved >= 0) this.set(at, moved);
    this.set(last, NOBODY);
    return moved;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    (this.mesh.material as THREE.Material).dispose();
    (this.mesh.customDepthMaterial as THREE.Material | undefined)?.dispose();
    this.places.value.dispose();
  }

  private get slots(): Uint32Array {
    return this.places.value.image.data as Uint32Array;
  }

  private set(at: number, slot: number): void {
    this.slots[at] = slot;
    this.places.value.needsUpdate = true;
    this.mesh.geometry.instanceCount = Math.ceil(this.count / this.copies);
    this.mesh.visible = this.count > 0;
  }

  private resize(rows: number): void {
    const slots = new Uint32Array(this.copies * rows).fill(NOBODY);
    slots.set(this.slots.subarray(0, this.count));
    this.places.value.dispose();
    this.places.value = placeTexture(slots, this.copies, rows);
  }
}

function placeTexture(slots: Uint32Array, copies: number, rows: number): THREE.DataTexture {
  const texture = new THREE.DataTexture(slots, copies, rows, THREE.RedIntegerFormat, THREE.UnsignedIntType);
  texture.internalFormat = 'R32UI';
  texture.unpackAlignment = 4;
  texture.needsUpdate = true;
  return texture;
}

// The geometry so many times, each with its number.
function repeated(geometry: THREE.BufferGeometry, copies: number): THREE.InstancedBufferGeometry {
  const pack = new THREE.InstancedBufferGeometry();
  const vertices = geometry.getAttribute('position')?.count ?? 0;
  for (const name of ['position', 'normal', 'color', 'paint']) {
    const attribute = geometry.getAttribute(name);
    if (!attribute) continue;
    const from = attribute.array as Float32Array;
    const array = new Float32Array(copies * from.length);
    for (let copy = 0; copy < copies; ++copy) array.set(from, copy * from.length);
    pack.setAttribute(name, new THREE.BufferAttribute(array, attribute.itemSize));
  }
  const numbers = new Uint8Array(copies * vertices);
  for (let copy = 0; copy < copies; ++copy) numbers.fill(copy, copy * vertices, (copy + 1) * vertices);
  pack.setAttribute('body', new THREE.BufferAttribute(numbers, 1));
  const corners = geometry.index?.count ?? vertices;
  const index = copies * vertices > 0xffff ? new Uint32Array(copies * corners) : new Uint16Array(copies * corners);
  for (let copy = 0, at = 0; copy < copies; ++copy) {
    for (let corner = 0; corner < corners; ++corner, ++at) index[at] = copy * vertices + (geometry.index ? geometry.index.getX(corner) : corner);
  }
  pack.setIndex(new THREE.BufferAttribute(index, 1));
  pack.instanceCount = 0;
  return pack;
}

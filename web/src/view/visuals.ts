// Visuals: the meshes that shapes are drawn with, as their files come.
//
// A shape with visuals is drawn by all of its meshes once their file is here and whole, or else as the shape that it is:
// `settled` is called with it either way, later than `add`. Files are asked of this gateway alone, by their hash, and kept
// while the page is open.

import * as THREE from 'three';
import { type Primitive, GlbError, MOST_BYTES, parseGlb } from '../protocol/glb.ts';
import type { ShapeVisuals, VisualMesh } from '../protocol/messages.ts';
import { LAYERLESS, Pictures } from './pictures.ts';

const WAIT_MS = 60_000;
// A gateway that cannot have a file for the moment says so, and remembers it for 5 s.
const NOT_NOW = 503;
const AGAIN_MS = 6_000;
const TRIES = 10;

export type Meshes = Primitive[][];

export interface VisualsListener {
  settled(shapes: number[]): void;
  problem(text: string): void; // once for each file
}

export class Visuals {
  drawn = 0; // shapes that meshes are drawn for
  readonly pictures: Pictures;
  private readonly files = new Map<string, Promise<Meshes | null>>(); // by hash; null: it cannot be had
  private readonly geometries = new Map<number, THREE.BufferGeometry>(); // by shape
  private readonly open = new Set<number>(); // shapes whose file is on its way
  private readonly layers = new Map<Uint8Array, Promise<number>>(); // by picture, LAYERLESS for one that cannot be drawn
  private world = 0; // counts the worlds, so that what comes late for another one is dropped
  private readonly listener: VisualsListener;
  private readonly load: (sha256: string) => Promise<Meshes>;

  constructor(listener: VisualsListener, load: (sha256: string) => Promise<Meshes> = loadMeshes, pictures = new Pictures()) {
    this.listener = listener;
    this.load = load;
    this.pictures = pictures;
  }

  clear(): void {
    ++this.world;
    this.drawn = 0;
    for (const geometry of this.geometries.values()) geometry.dispose();
    this.geometries.clear();
    this.open.clear();
    this.layers.clear();
    this.pictures.clear();
  }

  // Whether it is not known yet how the shape is drawn.
  waits(shape: number): boolean {
    return this.open.has(shape);
  }

  // Meshes in the shape's frame, with a colour for each vertex; null: the shape is drawn as it is.
  geometryOf(shape: number): THREE.BufferGeometry | null {
    return this.geometries.get(shape) ?? null;
  }

  // Shapes of one message come at once where they need the same files.
  add(visuals: ShapeVisuals[]): void {
    const groups = new Map<string, ShapeVisuals[]>();
    for (const one of visuals) {
      this.open.add(one.shape);
      const needed = [...new Set(one.meshes.map(({ sha256 }) => sha256))].sort().join();
      const group = groups.get(needed);
      if (group) group.push(one);
      else groups.set(needed, [one]);
    }
    for (const [needed, group] of groups) void this.settle(needed.split(','), group);
  }

  private async settle(needed: string[], group: ShapeVisuals[]): Promise<void> {
    const { world } = this;
    const files = new Map<string, Meshes | null>();
    for (const sha256 of needed) files.set(sha256, await this.file(sha256));
    if (world !== this.world) return;
    const layers = await this.readPictures(files, group);
    if (world !== this.world) return;
    const missing = new Set<string>();
    for (const { shape, meshes } of group) {
      const geometry = this.build(meshes, files, layers, missing);
      if (geometry) this.geometries.set(shape, geometry);
      if (geometry) ++this.drawn;
      this.open.delete(shape);
    }
    for (const text of missing) this.listener.problem(`${text}. Shapes are drawn in its place.`);
    this.listener.settled(group.map(({ shape }) => shape));
  }

  private file(sha256: string): Promise<Meshes | null> {
    let file = this.files.get(sha256);
    if (!file) {
      file = this.load(sha256).catch((error: unknown) => {
        this.listener.problem(`The meshes of ${sha256.slice(0, 12)}….glb cannot be drawn: ${error instanceof Error ? error.message : String(error)}. Shapes are drawn in their place.`);
        return null;
      });
      this.files.set(sha256, file);
    }
    return file;
  }

  // The layers of all pictures of the meshes that are drawn.
  private async readPictures(files: ReadonlyMap<string, Meshes | null>, group: ShapeVisuals[]): Promise<Map<Uint8Array, number>> {
    const layers = new Map<Uint8Array, number>();
    for (const { sha256, mesh } of group.flatMap(({ meshes }) => meshes)) {
      for (const { picture } of files.get(sha256)?.[mesh] ?? []) {
        if (picture && !layers.has(picture)) layers.set(picture, await this.layerOf(sha256, picture));
      }
    }
    return layers;
  }

  // One that cannot be had leaves the base colour, and is said once.
  private layerOf(sha256: string, picture: Uint8Array): Promise<number> {
    let layer = this.layers.get(picture);
    if (!layer) {
      layer = this.pictures.layerOf(picture).catch((error: unknown) => {
        this.listener.problem(`A picture of ${sha256.slice(0, 12)}….glb cannot be drawn: ${error instanceof Error ? error.message : String(error)}. Its meshes have their base colour.`);
        return LAYERLESS;
      });
      this.layers.set(picture, layer);
    }
    return layer;
  }

  private build(meshes: VisualMesh[], files: ReadonlyMap<string, Meshes | null>, layers: ReadonlyMap<Uint8Array, number>, missing: Set<string>): THREE.BufferGeometry | null {
    const parts: Part[] = [];
    for (const { sha256, mesh, position, orientation, scale } of meshes) {
      const file = files.get(sha256);
      if (!file) return null;
      const primitives = file[mesh];
      if (!primitives) {
        missing.add(`${sha256.slice(0, 12)}….glb has ${file.length} meshes and no mesh ${mesh}`);
        return null;
      }
      const matrix = new THREE.Matrix4().compose(new THREE.Vector3().fromArray(position), new THREE.Quaternion().fromArray(orientation), new THREE.Vector3().fromArray(scale));
      for (const primitive of primitives) {
        const layer = primitive.picture ? (layers.get(primitive.picture) ?? LAYERLESS) : LAYERLESS;
        parts.push({ primitive, matrix, layer });
      }
    }
    return parts.length === 0 ? null : joined(parts);
  }
}

// The gateway's answer, asked for again while it cannot have the file: its control plane is away, mostly for moments.
export async function askFor(path: string, ask = askOnce, pause = wait): Promise<Response> {
  for (let tried = 1; ; ++tried) {
    const answer = await ask(path);
    if (answer.status !== NOT_NOW || tried === TRIES) return answer;
    await pause(AGAIN_MS);
  }
}

function askOnce(path: string): Promise<Response> {
  return fetch(path, { signal: AbortSignal.timeout(WAIT_MS) });
}

function wait(ms: number): Promise<void> {
  return new Promise((done) => setTimeout(done, ms));
}

async function loadMeshes(sha256: string): Promise<Meshes> {
  const answer = await askFor(`/visuals/${sha256}.glb`);
  if (!answer.ok) throw new GlbError((await answer.text()).trim() || `the gateway answers ${answer.status}`);
  if (Number(answer.headers.get('content-length') ?? 0) > MOST_BYTES) throw new GlbError(`it has more than ${MOST_BYTES} bytes`);
  const bytes = await answer.arrayBuffer();
  // Browsers compute hashes for pages of this machine and by TLS alone; the gateway has compared it as well.
  if (globalThis.crypto?.subtle) {
    const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
    const hash = [...digest].map((byte) => byte.toString(16).padStart(2, '0')).join('');
    if (hash !== sha256) throw new GlbError('what came has another hash');
  }
  return parseGlb(bytes);
}

interface Part {
  primitive: Primitive;
  matrix: THREE.Matrix4;
  layer: number;
}

// Where it is, with what the vertices are painted with. Without normals it has flat faces; mirrored it keeps its outside.
function geometryOf({ primitive, matrix, layer }: Part): THREE.BufferGeometry {
  const { positions, normals, indices, colour, colours, places } = primitive;
  const vertices = positions.length / 3;
  const own = new Float32Array(3 * vertices);
  const paint = new Float32Array(3 * vertices);
  for (let at = 0; at < 3 * vertices; ++at) own[at] = colour[at % 3]! * (colours ? colours[at]! : 1);
  for (let at = 0; at < vertices; ++at) paint.set([places?.[2 * at] ?? 0, places?.[2 * at + 1] ?? 0, layer], 3 * at);
  const part = new THREE.BufferGeometry();
  part.setAttribute('position', new THREE.BufferAttribute(positions.slice(), 3));
  part.setAttribute('color', new THREE.BufferAttribute(own, 3));
  part.setAttribute('paint', new THREE.BufferAttribute(paint, 3));
  if (normals) part.setAttribute('normal', new THREE.BufferAttribute(normals.slice(), 3));
  part.setIndex(new THREE.BufferAttribute(matrix.determinant() < 0 ? turned(indices) : indices, 1));
  const whole = normals ? part : part.toNonIndexed();
  whole.applyMatrix4(matrix);
  if (!normals) whole.computeVertexNormals();
  return whole;
}

// All parts in one geometry.
function joined(parts: Part[]): THREE.BufferGeometry {
  const wholes = parts.map(geometryOf);
  const sizes = wholes.map((whole) => whole.getAttribute('position').count);
  const vertices = sizes.reduce((sum, size) => sum + size, 0);
  const corners = wholes.reduce((sum, whole, at) => sum + (whole.index?.count ?? sizes[at]!), 0);
  const names = ['position', 'normal', 'color', 'paint'];
  const all = names.map(() => new Float32Array(3 * vertices));
  const index = new Uint32Array(corners);
  let vertex = 0;
  let corner = 0;
  wholes.forEach((whole, at) => {
    names.forEach((name, one) => all[one]!.set(whole.getAttribute(name).array, 3 * vertex));
    const own = whole.index?.array;
    const count = own?.length ?? sizes[at]!;
    for (let one = 0; one < count; ++one) index[corner + one] = vertex + (own ? own[one]! : one);
    vertex += sizes[at]!;
    corner += count;
  });
  const geometry = new THREE.BufferGeometry();
  names.forEach((name, one) => geometry.setAttribute(name, new THREE.BufferAttribute(all[one]!, 3)));
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  geometry.computeBoundingSphere();
  geometry.computeBoundingBox();
  return geometry;
}

function turned(indices: Uint32Array): Uint32Array {
  const out = indices.slice();
  for (let at = 0; at + 2 < out.length; at += 3) [out[at + 1], out[at + 2]] = [out[at + 2]!, out[at + 1]!];
  return out;
}

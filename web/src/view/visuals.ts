// Visuals: the meshes that shapes are drawn with, as their files come.
//
// A shape with visuals is drawn by all of its meshes once their file is here and whole, or else as the shape that it is:
// `settled` is called with it either way, later than `add`. Files are asked of this gateway alone, by their hash, and kept
// while the page is open.

import * as THREE from 'three';
import { type Primitive, GlbError, MOST_BYTES, parseGlb } from '../protocol/glb.ts';
import type { ShapeVisuals, VisualMesh } from '../protocol/messages.ts';

const WAIT_MS = 60_000;

export type Meshes = Primitive[][];

export interface VisualsListener {
  settled(shapes: number[]): void;
  problem(text: string): void; // once for each file
}

export class Visuals {
  drawn = 0; // shapes that meshes are drawn for
  private readonly files = new Map<string, Promise<Meshes | null>>(); // by hash; null: it cannot be had
  private readonly geometries = new Map<number, THREE.BufferGeometry>(); // by shape
  private readonly open = new Set<number>(); // shapes whose file is on its way
  private world = 0; // counts the worlds, so that what comes late for another one is dropped
  private readonly listener: VisualsListener;
  private readonly load: (sha256: string) => Promise<Meshes>;

  constructor(listener: VisualsListener, load: (sha256: string) => Promise<Meshes> = loadMeshes) {
    this.listener = listener;
    this.load = load;
  }

  clear(): void {
    ++this.world;
    this.drawn = 0;
    for (const geometry of this.geometries.values()) geometry.dispose();
    this.geometries.clear();
    this.open.clear();
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
    const missing = new Set<string>();
    for (const { shape, meshes } of group) {
      const geometry = this.build(meshes, files, missing);
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

  private build(meshes: VisualMesh[], files: ReadonlyMap<string, Meshes | null>, missing: Set<string>): THREE.BufferGeometry | null {
    const parts: { primitive: Primitive; matrix: THREE.Matrix4 }[] = [];
    for (const { sha256, mesh, position, orientation, scale } of meshes) {
      const file = files.get(sha256);
      if (!file) return null;
      const primitives = file[mesh];
      if (!primitives) {
        missing.add(`${sha256.slice(0, 12)}….glb has ${file.length} meshes and no mesh ${mesh}`);
        return null;
      }
      const matrix = new THREE.Matrix4().compose(new THREE.Vector3().fromArray(position), new THREE.Quaternion().fromArray(orientation), new THREE.Vector3().fromArray(scale));
      for (const primitive of primitives) parts.push({ primitive, matrix });
    }
    return parts.length === 0 ? null : joined(parts);
  }
}

async function loadMeshes(sha256: string): Promise<Meshes> {
  const answer = await fetch(`/visuals/${sha256}.glb`, { signal: AbortSignal.timeout(WAIT_MS) });
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

// All parts in one geometry. A part without normals has flat faces; one that is mirrored keeps its outside.
function joined(parts: { primitive: Primitive; matrix: THREE.Matrix4 }[]): THREE.BufferGeometry {
  const wholes = parts.map(({ primitive, matrix }) => {
    const part = new THREE.BufferGeometry();
    part.setAttribute('position', new THREE.BufferAttribute(primitive.positions.slice(), 3));
    if (primitive.normals) part.setAttribute('normal', new THREE.BufferAttribute(primitive.normals.slice(), 3));
    part.setIndex(new THREE.BufferAttribute(matrix.determinant() < 0 ? turned(primitive.indices) : primitive.indices, 1));
    const whole = primitive.normals ? part : part.toNonIndexed();
    whole.applyMatrix4(matrix);
    if (!primitive.normals) whole.computeVertexNormals();
    return { whole, colour: primitive.colour };
  });
  const sizes = wholes.map(({ whole }) => whole.getAttribute('position').count);
  const vertices = sizes.reduce((sum, size) => sum + size, 0);
  const corners = wholes.reduce((sum, { whole }, at) => sum + (whole.index?.count ?? sizes[at]!), 0);
  const positions = new Float32Array(3 * vertices);
  const normals = new Float32Array(3 * vertices);
  const colours = new Float32Array(3 * vertices);
  const index = new Uint32Array(corners);
  let vertex = 0;
  let corner = 0;
  wholes.forEach(({ whole, colour }, at) => {
    positions.set(whole.getAttribute('position').array, 3 * vertex);
    normals.set(whole.getAttribute('normal').array, 3 * vertex);
    for (let one = 0; one < sizes[at]!; ++one) colours.set(colour, 3 * (vertex + one));
    const own = whole.index?.array;
    const count = own?.length ?? sizes[at]!;
    for (let one = 0; one < count; ++one) index[corner + one] = vertex + (own ? own[one]! : one);
    vertex += sizes[at]!;
    corner += count;
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
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

// Batches: one InstancedMesh for each shape, growing, so that thousands of bodies are drawn in a few calls.

import * as THREE from 'three';
import type { Bodies } from '../world/bodies.ts';
import { type Detail, type ShapeTable, makeGeometry } from './geometry.ts';
import { PAINT_FRAGMENT_HEAD, PAINT_VERTEX, PAINT_VERTEX_HEAD } from './pictures.ts';
import type { Visuals } from './visuals.ts';

const FIRST_CAPACITY = 64;

interface Batch {
  mesh: THREE.InstancedMesh;
  slots: number[]; // bodies of the instances, in order
  matrices: Float32Array;
  colours: Float32Array;
  moved: boolean;
  recoloured: boolean;
}

export class Batches {
  readonly group = new THREE.Group();
  private readonly batches = new Map<string, Batch>();
  private of: (Batch | undefined)[] = []; // by slot
  private place = new Int32Array(0); // by slot: its instance
  private readonly bodies: Bodies;
  private readonly shapes: ShapeTable;
  private readonly solid = new THREE.MeshLambertMaterial();
  private readonly trigger = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.25, depthWrite: false });

  // Bodies that are drawn by their own meshes: half of their colour is the mesh's, half says what the page is asked for.
  private readonly drawnSolid = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, vertexColors: true });
  private readonly visuals: Pick<Visuals, 'geometryOf' | 'pictures'>;

  private readonly detail: Detail;

  constructor(bodies: Bodies, shapes: ShapeTable, visuals: Pick<Visuals, 'geometryOf' | 'pictures'>, detail: Detail) {
    this.detail = detail;
    this.visuals = visuals;
    this.drawnSolid.onBeforeCompile = (shader) => {
      shader.uniforms['pictures'] = visuals.pictures.uniform;
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', `#include <common>\nvarying vec3 vTold;\n${PAINT_VERTEX_HEAD}`)
        .replace('#include <color_vertex>', `vColor = vec4(color, 1.0);\nvTold = instanceColor.rgb;\n${PAINT_VERTEX}`);
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', `#include <common>\nvarying vec3 vTold;\n${PAINT_FRAGMENT_HEAD}`)
        .replace('#include <color_fragment>', 'diffuseColor.rgb *= mix(painted(vColor.rgb), vTold, 0.5);');
    };
    this.bodies = bodies;
    this.shapes = shapes;
  }

  // How many instances the next picture draws.
  get drawn(): number {
    let sum = 0;
    for (const batch of this.batches.values()) sum += batch.mesh.count;
    return sum;
  }

  add(slot: number): void {
    const trigger = (this.bodies.flags[slot]! & 1) !== 0;
    const key = `${this.bodies.shape[slot]}${trigger ? ' trigger' : ''}`;
    let batch = this.batches.get(key);
    if (!batch) {
      batch = this.make(this.bodies.shape[slot]!, trigger);
      this.batches.set(key, batch);
    }
    if (batch.slots.length === batch.mesh.instanceMatrix.count) this.grow(batch);
    if (slot >= this.place.length) {
      const place = new Int32Array(Math.max(256, this.bodies.capacity));
      place.set(this.place);
      this.place = place;
    }
    this.of[slot] = batch;
    this.place[slot] = batch.slots.length;
    batch.slots.push(slot);
    batch.mesh.count = batch.slots.length;
  }

  // Shapes whose meshes have come, or will not.
  redraw(shapes: number[]): void {
    for (const shape of shapes) {
      const batch = this.batches.get(`${shape}`);
      const geometry = this.visuals.geometryOf(shape);
      if (!batch || !geometry) continue;
      batch.mesh.geometry.dispose();
      batch.mesh.geometry = geometry;
      batch.mesh.material = this.drawnSolid;
    }
  }

  remove(slot: number): void {
    const batch = this.of[slot];
    if (!batch) return;
    const at = this.place[slot]!;
    const last = batch.slots.length - 1;
    const moved = batch.slots[last]!;
    batch.matrices.copyWithin(16 * at, 16 * last, 16 * last + 16);
    batch.colours.copyWithin(3 * at, 3 * last, 3 * last + 3);
    batch.slots[at] = moved;
    this.place[moved] = at;
    batch.slots.pop();
    batch.mesh.count = last;
    batch.moved = batch.recoloured = true;
    this.of[slot] = undefined;
  }

  setColour(slot: number, red: number, green: number, blue: number): void {
    const batch = this.of[slot];
    if (!batch) return;
    const at = 3 * this.place[slot]!;
    batch.colours[at] = red;
    batch.colours[at + 1] = green;
    batch.colours[at + 2] = blue;
    batch.recoloured = true;
  }

  colour(slot: number): number[] {
    const batch = this.of[slot];
    const at = 3 * this.place[slot]!;
    return batch ? [...batch.colours.subarray(at, at + 3)] : [];
  }

  // Poses of all that moves, `fraction` of the way from the previous to the current one.
  pose(fraction: number): void {
    const { moving, moving_count, previous, current, shown } = this.bodies;
    const rest = 1 - fraction;
    for (let index = 0; index < moving_count; ++index) {
      const slot = moving[index]!;
      const batch = this.of[slot]!;
      const p = 7 * slot;
      let ax = current[p + 3]!;
      let ay = current[p + 4]!;
      let az = current[p + 5]!;
      let aw = current[p + 6]!;
      const bx = previous[p + 3]!;
      const by = previous[p + 4]!;
      const bz = previous[p + 5]!;
      const bw = previous[p + 6]!;
      // A normalised mean of the two, along the shorter way.
      const back = ax * bx + ay * by + az * bz + aw * bw < 0 ? -rest : rest;
      ax = ax * fraction + bx * back;
      ay = ay * fraction + by * back;
      az = az * fraction + bz * back;
      aw = aw * fraction + bw * back;
      const scale = 1 / Math.sqrt(ax * ax + ay * ay + az * az + aw * aw);
      shown[p] = previous[p]! * rest + current[p]! * fraction;
      shown[p + 1] = previous[p + 1]! * rest + current[p + 1]! * fraction;
      shown[p + 2] = previous[p + 2]! * rest + current[p + 2]! * fraction;
      shown[p + 3] = ax * scale;
      shown[p + 4] = ay * scale;
      shown[p + 5] = az * scale;
      shown[p + 6] = aw * scale;
      writeMatrix(shown, p, batch.matrices, 16 * this.place[slot]!);
      batch.moved = true;
    }
    this.bodies.drawn();
    if (fraction === 1) this.arrive();
  }

  // Bodies that are where the newest frame has them need no work until they move again.
  private arrive(): void {
    const { moving, moving_count, current, shown } = this.bodies;
    for (let index = 0; index < moving_count; ++index) {
      const p = 7 * moving[index]!;
      for (let part = p; part < p + 7; ++part) shown[part] = current[part]!;
    }
    this.bodies.moving_count = 0;
  }

  upload(): void {
    for (const batch of this.batches.values()) {
      if (batch.moved) {
        batch.mesh.instanceMatrix.clearUpdateRanges();
        batch.mesh.instanceMatrix.addUpdateRange(0, 16 * batch.mesh.count);
        batch.mesh.instanceMatrix.needsUpdate = true;
      }
      if (batch.recoloured) batch.mesh.instanceColor!.needsUpdate = true;
      batch.moved = batch.recoloured = false;
    }
  }

  geometryOf(slot: number): THREE.BufferGeometry | null {
    return this.of[slot]?.mesh.geometry ?? null;
  }

  setShadows(on: boolean): void {
    for (const batch of this.batches.values()) batch.mesh.castShadow = batch.mesh.receiveShadow = on;
    this.shadows = on;
  }
  private shadows = false;

  clear(): void {
    for (const batch of this.batches.values()) {
      this.group.remove(batch.mesh);
      batch.mesh.geometry.dispose();
      batch.mesh.dispose();
    }
    this.batches.clear();
    this.of = [];
  }

  private make(shape: number, trigger: boolean): Batch {
    const drawn = trigger ? null : this.visuals.geometryOf(shape);
    const geometry = drawn ?? makeGeometry(this.shapes.get(shape)!, this.shapes, this.detail);
    geometry.computeBoundingSphere();
    geometry.computeBoundingBox();
    const solid = drawn ? this.drawnSolid : this.solid;
    const batch: Batch = {
      mesh: new THREE.InstancedMesh(geometry, trigger ? this.trigger : solid, 0),
      slots: [],
      matrices: new Float32Array(0),
      colours: new Float32Array(0),
      moved: false,
      recoloured: false,
    };
    this.grow(batch);
    return batch;
  }

  // An InstancedMesh has a fixed capacity, so a larger one takes its place.
  private grow(batch: Batch): void {
    const capacity = Math.max(FIRST_CAPACITY, 2 * batch.slots.length);
    const { geometry, material } = batch.mesh;
    const mesh = new THREE.InstancedMesh(geometry, material, capacity);
    mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    mesh.instanceColor = new THREE.InstancedBufferAttribute(new Float32Array(3 * capacity), 3);
    mesh.frustumCulled = false; // it has no bounds of its own: its instances are everywhere
    mesh.castShadow = mesh.receiveShadow = this.shadows;
    mesh.count = batch.slots.length;
    const matrices = mesh.instanceMatrix.array as Float32Array;
    const colours = mesh.instanceColor.array as Float32Array;
    matrices.set(batch.matrices.subarray(0, 16 * batch.slots.length));
    colours.set(batch.colours.subarray(0, 3 * batch.slots.length));
    this.group.remove(batch.mesh);
    batch.mesh.dispose();
    this.group.add(mesh);
    Object.assign(batch, { mesh, matrices, colours, moved: true, recoloured: true });
  }
}

// Column by column, as WebGL has it, of a pose of unit orientation.
function writeMatrix(pose: Float32Array, p: number, out: Float32Array, at: number): void {
  const x = pose[p + 3]!;
  const y = pose[p + 4]!;
  const z = pose[p + 5]!;
  const w = pose[p + 6]!;
  const x2 = x + x;
  const y2 = y + y;
  const z2 = z + z;
  out[at] = 1 - y * y2 - z * z2;
  out[at + 1] = x * y2 + w * z2;
  out[at + 2] = x * z2 - w * y2;
  out[at + 3] = 0;
  out[at + 4] = x * y2 - w * z2;
  out[at + 5] = 1 - x * x2 - z * z2;
  out[at + 6] = y * z2 + w * x2;
  out[at + 7] = 0;
  out[at + 8] = x * z2 + w * y2;
  out[at + 9] = y * z2 - w * x2;
  out[at + 10] = 1 - x * x2 - y * y2;
  out[at + 11] = 0;
  out[at + 12] = pose[p]!;
  out[at + 13] = pose[p + 1]!;
  out[at + 14] = pose[p + 2]!;
  out[at + 15] = 1;
}

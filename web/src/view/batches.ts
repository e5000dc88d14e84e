// Batches: what draws the bodies. Each shape has geometries of several details, each a Pack of the bodies that it is the
// right one for: a body moves from one to another as it grows or shrinks on the screen.

import * as THREE from 'three';
import { type Bodies, POSE_PARTS } from '../world/bodies.ts';
import { DETAILS, type ShapeTable, detailFor, isRound, makeGeometry } from './geometry.ts';
import { BodyTextures, Pack, type PackUniforms, drawsPacks } from './packs.ts';
import { PAINT_FRAGMENT_HEAD, PAINT_VERTEX, PAINT_VERTEX_HEAD } from './pictures.ts';
import { type PlainLight, plainBodies } from './plain.ts';
import type { Visuals } from './visuals.ts';

const LEAST_JUDGED = 512; // bodies a picture whose detail is judged anew
const SHARE_JUDGED = 0.125; // a share of all bodies, where that is more

type Look = 'solid' | 'trigger' | 'drawn'; // drawn: by meshes of a file

interface Batch {
  look: Look;
  geometry: THREE.BufferGeometry; // the finest, which bodies are picked by
  radius: number;
  packs: (Pack | null)[]; // by detail, the finest first; those of shapes that are not round have one
}

export class Batches {
  readonly group = new THREE.Group();
  private readonly textures = new BodyTextures();
  private readonly batches = new Map<string, Batch>();
  private of: (Batch | undefined)[] = []; // by slot
  private detail = new Uint8Array(0); // by slot
  private place = new Int32Array(0); // by slot: its place in its pack
  private judged = 0; // place in the bodies' order where the last picture stopped
  private shadows = false;
  private plain = false;
  private readonly bodies: Bodies;
  private readonly shapes: ShapeTable;
  private readonly visuals: Pick<Visuals, 'geometryOf' | 'pictures'>;
  private readonly light: PlainLight;

  constructor(bodies: Bodies, shapes: ShapeTable, visuals: Pick<Visuals, 'geometryOf' | 'pictures'>, light: PlainLight) {
    this.bodies = bodies;
    this.shapes = shapes;
    this.visuals = visuals;
    this.light = light;
  }

  // How many bodies the next picture draws.
  get drawn(): number {
    let sum = 0;
    for (const pack of this.packs()) sum += pack.count;
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
    if (slot >= this.place.length) {
      const capacity = Math.max(256, this.bodies.capacity);
      const place = new Int32Array(capacity);
      const detail = new Uint8Array(capacity);
      place.set(this.place);
      detail.set(this.detail);
      Object.assign(this, { place, detail });
    }
    this.textures.reserve(slot + 1, this.bodies.capacity, this.bodies.shown);
    this.of[slot] = batch;
    this.put(slot, batch, batch.packs.length - 1);
  }

  // Shapes whose meshes have come, or will not.
  redraw(shapes: number[]): void {
    for (const shape of shapes) {
      const batch = this.batches.get(`${shape}`);
      const geometry = this.visuals.geometryOf(shape);
      if (!batch || !geometry) continue;
      this.free(batch);
      Object.assign(batch, this.batchOf('drawn', geometry, 1));
      for (let place = 0; place < this.bodies.count; ++place) {
        const slot = this.bodies.order[place]!;
        if (this.of[slot] === batch) this.put(slot, batch, 0);
      }
    }
  }

  remove(slot: number): void {
    const batch = this.of[slot];
    if (!batch) return;
    this.take(slot, batch);
    this.of[slot] = undefined;
  }

  setColour(slot: number, red: number, green: number, blue: number): void {
    if (this.of[slot]) this.textures.setColour(slot, red, green, blue);
  }

  colour(slot: number): number[] {
    return this.of[slot] ? this.textures.colour(slot) : [];
  }

  // The poses that the bodies are shown with have changed.
  posed(): void {
    this.textures.show(this.bodies.shown);
  }

  // Gives some of the bodies the detail for their size on the screen, which has `pixels` of height for an angle of one.
  judge(eye: THREE.Vector3, pixels: number): void {
    const { count, order, shown } = this.bodies;
    const part = Math.min(count, Math.max(LEAST_JUDGED, Math.ceil(SHARE_JUDGED * count)));
    for (let left = part; left > 0; --left) {
      if (++this.judged >= count) this.judged = 0;
      const slot = order[this.judged]!;
      const batch = this.of[slot];
      if (!batch || batch.packs.length === 1) continue;
      const at = POSE_PARTS * slot;
      const distance = Math.hypot(shown[at]! - eye.x, shown[at + 1]! - eye.y, shown[at + 2]! - eye.z);
      const detail = detailFor((batch.radius * pixels) / Math.max(0.01, distance), this.detail[slot]!);
      if (detail === this.detail[slot]) continue;
      this.take(slot, batch);
      this.put(slot, batch, detail);
    }
  }

  geometryOf(slot: number): THREE.BufferGeometry | null {
    return this.of[slot]?.geometry ?? null;
  }

  setShadows(on: boolean): void {
    this.shadows = on;
    for (const pack of this.packs()) pack.mesh.castShadow = pack.mesh.receiveShadow = on;
  }

  // Whether plain light is enough, which has no shadows.
  setPlain(on: boolean): void {
    this.plain = on;
    for (const batch of this.batches.values()) {
      for (const pack of batch.packs) {
        if (!pack) continue;
        (pack.mesh.material as THREE.Material).dispose();
        pack.mesh.material = this.material(batch.look, this.uniforms(pack.places));
      }
    }
  }

  clear(): void {
    for (const batch of this.batches.values()) {
      this.free(batch);
      batch.geometry.dispose();
    }
    this.batches.clear();
    this.of = [];
  }

  private *packs(): Iterable<Pack> {
    for (const batch of this.batches.values()) {
      for (const pack of batch.packs) if (pack) yield pack;
    }
  }

  private put(slot: number, batch: Batch, detail: number): void {
    const pack = (batch.packs[detail] ??= this.pack(batch, this.geometryFor(slot, batch, detail)));
    this.detail[slot] = detail;
    this.place[slot] = pack.add(slot);
  }

  private take(slot: number, batch: Batch): void {
    const moved = batch.packs[this.detail[slot]!]!.remove(this.place[slot]!);
    if (moved >= 0) this.place[moved] = this.place[slot]!;
  }

  private geometryFor(slot: number, batch: Batch, detail: number): THREE.BufferGeometry {
    if (detail === 0) return batch.geometry;
    return makeGeometry(this.shapes.get(this.bodies.shape[slot]!)!, this.shapes, DETAILS[detail]!);
  }

  private make(number: number, trigger: boolean): Batch {
    const drawn = trigger ? null : this.visuals.geometryOf(number);
    if (drawn) return this.batchOf('drawn', drawn, 1);
    const shape = this.shapes.get(number)!;
    const geometry = makeGeometry(shape, this.shapes, 'fine');
    return this.batchOf(trigger ? 'trigger' : 'solid', geometry, isRound(shape, this.shapes) ? DETAILS.length : 1);
  }

  private batchOf(look: Look, geometry: THREE.BufferGeometry, details: number): Batch {
    geometry.computeBoundingSphere();
    geometry.computeBoundingBox();
    const radius = geometry.boundingSphere?.radius ?? 0;
    return { look, geometry, radius, packs: new Array<Pack | null>(details).fill(null) };
  }

  private pack(batch: Batch, geometry: THREE.BufferGeometry): Pack {
    const pack = new Pack(geometry, (places) => this.material(batch.look, this.uniforms(places)));
    const depth = new THREE.MeshDepthMaterial();
    drawsPacks(depth, 'depth', this.uniforms(pack.places));
    pack.mesh.customDepthMaterial = depth;
    pack.mesh.castShadow = pack.mesh.receiveShadow = this.shadows;
    this.group.add(pack.mesh);
    return pack;
  }

  private free(batch: Batch): void {
    batch.packs.forEach((pack, detail) => {
      if (pack) this.group.remove(pack.mesh);
      pack?.dispose();
      batch.packs[detail] = null;
    });
  }

  private uniforms(places: PackUniforms['places']): PackUniforms {
    return { poses: this.textures.poses, colours: this.textures.colours, places };
  }

  private material(look: Look, uniforms: PackUniforms): THREE.Material {
    if (look === 'solid' && this.plain) return plainBodies(this.light, uniforms);
    const material = look === 'drawn' ? this.drawnByMeshes() : new THREE.MeshLambertMaterial();
    if (look === 'trigger') Object.assign(material, { transparent: true, opacity: 0.25, depthWrite: false });
    drawsPacks(material, look, uniforms);
    return material;
  }

  // Half of their colour is the mesh's, half says what the page is asked for.
  private drawnByMeshes(): THREE.MeshLambertMaterial {
    const material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, vertexColors: true });
    material.onBeforeCompile = (shader) => {
      shader.uniforms['pictures'] = this.visuals.pictures.uniform;
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', `#include <common>\nvarying vec3 vTold;\n${PAINT_VERTEX_HEAD}`)
        .replace('#include <color_vertex>', `vColor = vec4(color, 1.0);\nvTold = instanceColor.rgb;\n${PAINT_VERTEX}`);
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', `#include <common>\nvarying vec3 vTold;\n${PAINT_FRAGMENT_HEAD}`)
        .replace('#include <color_fragment>', 'diffuseColor.rgb *= mix(painted(vColor.rgb), vTold, 0.5);');
    };
    return material;
  }
}

// Level: the bodies that never move, coloured by who owns the ground below them.
//
// A level may have thousands of bodies. Those of one message are sorted by their shape: a shape that many of them have is
// drawn as instances, and all others are baked together, so that the picture takes a few calls however many bodies there
// are. The work is linear in what the messages hold, and what has been drawn once is not touched again: bodies that are
// drawn by meshes of a file wait for it, and come when it has, or as their shapes when it will not. What a tile of a large
// level brought goes with it.

import * as THREE from 'three';
import type { StaticBody } from '../protocol/messages.ts';
import { type Placed, bake, bakedSize } from './bake.ts';
import { type ShapeTable, makeGeometry } from './geometry.ts';
import { PAINT_FRAGMENT_HEAD, PAINT_VERTEX, PAINT_VERTEX_HEAD, Pictures } from './pictures.ts';
import { PlainLight, plainLevel, shown } from './plain.ts';
import type { Territory, Theme } from './territory.ts';
import type { Visuals } from './visuals.ts';

const INSTANCED_FROM = 8; // bodies of one shape in a message
const NO_TILE = -1;
const MOST_BAKED = 1 << 20; // vertices of a mesh: 28 MB

const GROUND = new THREE.PlaneGeometry(4000, 4000).rotateX(-Math.PI / 2);

type LevelVisuals = Pick<Visuals, 'geometryOf' | 'waits' | 'pictures'>;

export class Level {
  readonly group = new THREE.Group();
  private readonly uniforms;
  private readonly ground: Surface;
  private readonly solid: Surface;
  private readonly trigger = surface(new THREE.MeshLambertMaterial({
    color: '#5ee0c0',
    transparent: true,
    opacity: 0.22,
    depthWrite: false,
  }));
  private readonly drawn: Surface; // by its own meshes, in their colours
  private readonly waiting = new Map<number, { body: StaticBody; tile: number }[]>(); // by shape
  private readonly tiles = new Map<number, { meshes: THREE.Mesh[]; bodies: number }>(); // each with all that it brought
  private readonly visuals: LevelVisuals;
  private readonly floor: THREE.Mesh;
  private has_plane = false;
  private lowest = Infinity;
  private bodies = 0;
  private plain = false;

  constructor(territory: Pick<Territory, 'texture' | 'area'>, visuals: LevelVisuals = { geometryOf: () => null, waits: () => false, pictures: new Pictures() }, light = new PlainLight()) {
    this.visuals = visuals;
    this.uniforms = {
      territory: { value: territory.texture },
      area: { value: territory.area },
      pictures: visuals.pictures.uniform,
      outside: { value: new THREE.Color() },
      outsideShown: { value: new THREE.Vector3() },
    };
    this.ground = surface(this.material(1), plainLevel(light, this.uniforms, 1));
    this.solid = surface(this.material(1.9), plainLevel(light, this.uniforms, 1.9));
    this.drawn = surface(this.material(1.9, true));
    this.floor = new THREE.Mesh(GROUND, this.ground.full);
    // Bodies hide some of the ground, which is drawn where it is seen.
    this.floor.renderOrder = 1;
    this.group.add(this.floor);
  }

  get count(): number {
    return this.bodies;
  }

  // Colours what is lit by the picture of the territory, `bright` times as light as the ground, under the meshes' own
  // colours and pictures where they have some.
  private material(bright: number, own = false): THREE.MeshLambertMaterial {
    const material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, vertexColors: own });
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', `#include <common>\nvarying vec3 vWorld;\n${own ? PAINT_VERTEX_HEAD : ''}`)
        .replace(
          '#include <project_vertex>',
          `#include <project_vertex>
           ${own ? PAINT_VERTEX : ''}
           vec4 placed = vec4(transformed, 1.0);
           #ifdef USE_INSTANCING
             placed = instanceMatrix * placed;
           #endif
           vWorld = (modelMatrix * placed).xyz;`,
        );
      shader.fragmentShader = shader.fragmentShader
        .replace(
          '#include <common>',
          `#include <common>\nvarying vec3 vWorld;\nuniform sampler2D territory;\nuniform vec4 area;\nuniform vec3 outside;\n${own ? PAINT_FRAGMENT_HEAD : ''}`,
        )
        .replace(
          '#include <color_fragment>',
          `vec2 place = (vWorld.xz - area.xy) * area.zw;
           vec2 within = step(vec2(0.0), place) * step(place, vec2(1.0));
           diffuseColor.rgb = mix(outside, texture2D(territory, place).rgb, within.x * within.y) * ${bright.toFixed(2)};
           ${own ? 'diffuseColor.rgb = mix(diffuseColor.rgb, painted(vColor.rgb), 0.7);' : ''}`,
        );
    };
    material.customProgramCacheKey = () => `territory ${bright} ${own}`;
    return material;
  }

  setTheme(theme: Theme): void {
    this.uniforms.outside.value.set(theme.ground).multiplyScalar(0.8);
    this.uniforms.outsideShown.value.copy(shown(this.uniforms.outside.value));
  }

  // Whether plain light is enough, which has no shadows.
  setPlain(on: boolean): void {
    this.plain = on;
    for (const mesh of this.group.children as THREE.Mesh[]) {
      for (const surface of [this.ground, this.solid]) {
        if (mesh.material === surface.full || mesh.material === surface.plain) mesh.material = on ? surface.plain : surface.full;
      }
    }
  }

  // All bodies of a message, or of a tile (0 and up), whose shapes are known.
  add(statics: StaticBody[], shapes: ShapeTable, tile = NO_TILE): void {
    if (tile !== NO_TILE && !this.tiles.has(tile)) this.tiles.set(tile, { meshes: [], bodies: 0 });
    const groups = new Map<string, StaticBody[]>();
    for (const body of statics) {
      if (!shapes.has(body.shape)) continue;
      if (!body.trigger && this.visuals.waits(body.shape)) {
        const waiting = this.waiting.get(body.shape);
        if (waiting) waiting.push({ body, tile });
        else this.waiting.set(body.shape, [{ body, tile }]);
        continue;
      }
      const key = `${body.shape}${body.trigger ? ' trigger' : ''}`;
      const group = groups.get(key);
      if (group) group.push(body);
      else groups.set(key, [body]);
    }
    const baked = new Map<Surface, Placed[]>();
    for (const group of groups.values()) {
      const shape = shapes.get(group[0]!.shape)!;
      const many = group.length >= INSTANCED_FROM;
      const meshes = group[0]!.trigger ? null : this.visuals.geometryOf(group[0]!.shape);
      const geometry = meshes ?? makeGeometry(shape, shapes, many ? 'usual' : 'fine');
      const flat = shape.kind === 'plane' || shape.kind === 'field';
      if (shape.kind === 'plane') this.has_plane = true;
      const material = group[0]!.trigger ? this.trigger : meshes ? this.drawn : flat ? this.ground : this.solid;
      const placed = group.map((body) => ({ geometry, matrix: matrixOf(body) }));
      this.measure(geometry, placed);
      this.bodies += group.length;
      const brought = this.tiles.get(tile);
      if (brought) brought.bodies += group.length;
      if (many) this.show(instances(geometry, placed), material, tile);
      else if (baked.has(material)) baked.get(material)!.push(...placed);
      else baked.set(material, placed);
    }
    for (const [material, placed] of baked) this.bake(material, placed, tile);
    this.placeFloor();
  }

  // It is known how these shapes are drawn.
  settle(numbers: number[], shapes: ShapeTable): void {
    const waited = numbers.flatMap((shape) => this.waiting.get(shape) ?? []);
    for (const shape of numbers) this.waiting.delete(shape);
    for (const tile of new Set(waited.map((one) => one.tile))) {
      this.add(waited.filter((one) => one.tile === tile).map(({ body }) => body), shapes, tile);
    }
  }

  // All that the tile brought.
  drop(tile: number): void {
    const brought = this.tiles.get(tile);
    if (!brought) return;
    this.tiles.delete(tile);
    for (const mesh of brought.meshes) this.free(mesh);
    this.bodies -= brought.bodies;
    for (const [shape, waiting] of this.waiting) this.waiting.set(shape, waiting.filter((one) => one.tile !== tile));
  }

  private bake(material: Surface, placed: Placed[], tile: number): void {
    let begin = 0;
    let vertices = 0;
    for (let at = 0; at <= placed.length; ++at) {
      const size = at < placed.length ? bakedSize(placed[at]!.geometry) : Infinity;
      if (at > begin && vertices + size > MOST_BAKED) {
        this.show(new THREE.Mesh(bake(placed.slice(begin, at))), material, tile);
        begin = at;
        vertices = 0;
      }
      vertices += size;
    }
    for (const { geometry } of placed) geometry.dispose();
  }

  private show(mesh: THREE.Mesh, material: Surface, tile: number): void {
    this.tiles.get(tile)?.meshes.push(mesh);
    mesh.material = this.plain ? material.plain : material.full;
    mesh.renderOrder = 1;
    mesh.receiveShadow = material !== this.trigger;
    mesh.castShadow = material === this.solid || material === this.drawn;
    mesh.matrixAutoUpdate = false;
    this.group.add(mesh);
  }

  private measure(geometry: THREE.BufferGeometry, placed: Placed[]): void {
    geometry.computeBoundingBox();
    const box = new THREE.Box3();
    for (const { matrix } of placed) {
      box.copy(geometry.boundingBox!).applyMatrix4(matrix);
      if (!box.isEmpty()) this.lowest = Math.min(this.lowest, box.min.y);
    }
  }

  // A world without a plane gets a floor just below all that it has, so that depth can be read.
  private placeFloor(): void {
    this.floor.visible = !this.has_plane;
    this.floor.position.y = Number.isFinite(this.lowest) ? this.lowest - 0.02 : 0;
  }

  private free(mesh: THREE.Mesh): void {
    this.group.remove(mesh);
    mesh.geometry.dispose();
    if (mesh instanceof THREE.InstancedMesh) mesh.dispose();
  }

  clear(): void {
    for (const child of [...this.group.children] as THREE.Mesh[]) {
      if (child !== this.floor) this.free(child);
    }
    this.tiles.clear();
    this.waiting.clear();
    this.has_plane = false;
    this.lowest = Infinity;
    this.bodies = 0;
    this.placeFloor();
  }
}

// How something is drawn in full light and in plain light.
interface Surface {
  full: THREE.Material;
  plain: THREE.Material;
}

function surface(full: THREE.Material, plain = full): Surface {
  return { full, plain };
}

const ONE = new THREE.Vector3(1, 1, 1);

function matrixOf(body: StaticBody): THREE.Matrix4 {
  return new THREE.Matrix4().compose(
    new THREE.Vector3().fromArray(body.position),
    new THREE.Quaternion().fromArray(body.orientation),
    ONE,
  );
}

function instances(geometry: THREE.BufferGeometry, placed: Placed[]): THREE.InstancedMesh {
  const mesh = new THREE.InstancedMesh(geometry, undefined, placed.length);
  placed.forEach(({ matrix }, index) => mesh.setMatrixAt(index, matrix));
  mesh.computeBoundingSphere();
  return mesh;
}

// WorldView: the world in 3D. It is given messages through World and draws what that holds.

import * as THREE from 'three';
import type { Met, PartitionMap, StaticBody } from '../protocol/messages.ts';
import { type Bodies, POSE_PARTS, TURN } from '../world/bodies.ts';
import type { Values } from '../world/values.ts';
import { Batches } from './batches.ts';
import { CameraRig } from './camera_rig.ts';
import { type ColourMode, bodyColour } from './colours.ts';
import { Contacts } from './contacts.ts';
import type { ShapeTable } from './geometry.ts';
import { Level } from './level.ts';
import { pick } from './picking.ts';
import { PlainLight } from './plain.ts';
import { Territory, type Theme } from './territory.ts';
import { Tiles } from './tiles.ts';
import { Visuals } from './visuals.ts';

const FLASH_S = 0.7; // a body that changes its owner lights up for so long
const DARK: Theme = { ground: '#1b212c', level: '#39445a', background: '#0c1017', ink: '#e8eefc' };
const LIGHT: Theme = { ground: '#cfd6e1', level: '#ffffff', background: '#e7ecf3', ink: '#1c2530' };

export class NoWebGl extends Error {}

export class WorldView {
  readonly rig: CameraRig;
  readonly batches: Batches;
  readonly level: Level;
  readonly visuals: Visuals;
  readonly tiles: Tiles;
  readonly contacts = new Contacts();
  readonly software: boolean;
  mode: ColourMode = 'region';
  selected = -1;
  follows = false;
  own = -1;
  readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly territory: Territory;
  private readonly light = new PlainLight();
  private readonly sky = new THREE.HemisphereLight('#ffffff', '#8a90a0', 1.9);
  private readonly sun = new THREE.DirectionalLight('#fff4e0', 2.0);
  private readonly outline: THREE.LineSegments;
  private readonly arrow: THREE.Mesh;
  private readonly bodies: Bodies;
  private readonly shapes: ShapeTable;
  private readonly flashes = new Map<number, number>(); // slot: seconds at which it began
  private dead: ReadonlySet<number> = new Set();
  private map: PartitionMap | null = null;
  private bounds = [-50, 0, -50, 50, 20, 50];
  private theme = DARK;
  private size = { width: 1, height: 1 }; // the canvas, as the page sees it: asking it costs a layout
  private posed: Float32Array | null = null; // as the last picture has them

  private readonly values: Values;

  constructor(canvas: HTMLCanvasElement, bodies: Bodies, shapes: ShapeTable, values: Values, problem: (text: string) => void) {
    this.values = values;
    this.bodies = bodies;
    this.shapes = shapes;
    this.software = drawsInSoftware();
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !this.software, powerPreference: 'high-performance' });
    } catch (error) {
      throw new NoWebGl(String(error));
    }
    this.renderer.setPixelRatio(this.software ? 1 : Math.min(2, devicePixelRatio));
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.territory = new Territory(this.software);
    this.rig = new CameraRig(canvas);
    const settled = (numbers: number[]) => {
      this.batches.redraw(numbers);
      this.level.settle(numbers, this.shapes);
    };
    this.visuals = new Visuals({ settled, problem });
    this.batches = new Batches(bodies, shapes, this.visuals, this.light);
    this.level = new Level(this.territory, this.visuals, this.light);
    this.tiles = new Tiles({
      came: (tile, { shapes: made, visuals, statics }) => {
        for (const { number, shape } of made) this.shapes.set(number, shape);
        this.visuals.add(visuals);
        this.level.add(statics, this.shapes, tile);
      },
      gone: (tile, { shapes: made }) => {
        this.level.drop(tile);
        for (const { number } of made) this.shapes.delete(number);
      },
      problem,
    });
    this.outline = makeOutline();
    this.arrow = makeArrow();
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.bias = -0.0006;
    this.sun.shadow.normalBias = 0.04;
    this.scene.add(this.sky, this.sun, this.sun.target, this.level.group, this.batches.group, this.territory.curtains);
    this.scene.add(this.outline, this.arrow, this.contacts.points);
    this.setPlain(this.software);
    this.setTheme(true);
    this.rig.frame(this.bounds, false);
  }

  setTheme(dark: boolean): void {
    this.theme = dark ? DARK : LIGHT;
    this.scene.background = new THREE.Color(this.theme.background);
    this.level.setTheme(this.theme);
    this.sky.intensity = dark ? 1.5 : 2.0;
    this.sun.intensity = dark ? 2.3 : 1.9;
    this.setFog();
    this.drawTerritory();
  }

  setShadows(on: boolean): void {
    this.setPlain(this.software && !on);
    this.renderer.shadowMap.enabled = on;
    this.sun.castShadow = on;
    this.batches.setShadows(on);
    this.scene.traverse((object) => {
      if (object instanceof THREE.Mesh) (object.material as THREE.Material).needsUpdate = true;
    });
  }

  setBounds(bounds: number[]): void {
    this.bounds = bounds;
    this.setFog();
    this.rig.frame(bounds, false);
  }

  setMap(map: PartitionMap): void {
    this.map = map;
    this.drawTerritory();
  }

  setDead(dead: ReadonlySet<number>): void {
    this.dead = dead;
    this.drawTerritory();
    this.recolourAll();
  }

  setMode(mode: ColourMode): void {
    this.mode = mode;
    this.recolourAll();
  }

  setBorders(on: boolean): void {
    this.territory.curtains.visible = on;
  }

  // Values of the property that bodies are coloured by have come: of these bodies, or such that all look different.
  valued(ids: string[], all: boolean): void {
    if (this.mode !== 'property') return;
    if (all) return this.recolourAll();
    for (const id of ids) {
      const slot = this.bodies.find(id);
      if (slot >= 0 && !this.flashes.has(slot)) this.recolour(slot);
    }
  }

  addStatics(statics: StaticBody[]): void {
    this.level.add(statics, this.shapes);
  }

  showContact(met: Met): void {
    const slot = [met.body, met.other].map((body) => this.bodies.find(body)).find((found) => found >= 0);
    const place = slot === undefined ? null : this.bodies.shown.subarray(POSE_PARTS * slot, POSE_PARTS * slot + 3);
    this.contacts.add(met, place);
  }

  // How many bodies light up because they have changed their owner.
  get flashing(): number {
    return this.flashes.size;
  }

  // Bodies calls these as its listener.
  appeared(slot: number): void {
    this.batches.add(slot);
    this.recolour(slot);
  }

  vanished(slot: number): void {
    this.batches.remove(slot);
    this.flashes.delete(slot);
    if (this.selected === slot) this.selected = -1;
    if (this.own === slot) this.own = -1;
  }

  ownerChanged(slot: number, from: number): void {
    if (from === 0) this.recolour(slot);
    else this.flashes.set(slot, performance.now() / 1000);
  }

  // The states of these bodies have changed: slot, state, slot, state, ...
  recolourChanged(states: number[]): void {
    for (let at = 0; at < states.length; at += 2) {
      const slot = states[at]!;
      if (!this.flashes.has(slot)) this.recolour(slot);
    }
  }

  clear(): void {
    this.batches.clear();
    this.tiles.clear();
    this.level.clear();
    this.visuals.clear();
    this.flashes.clear();
    this.contacts.clear();
    this.selected = this.own = -1;
    this.follows = false;
  }

  pickAt(x: number, y: number): number {
    const canvas = this.renderer.domElement.getBoundingClientRect();
    const caster = new THREE.Raycaster();
    const place = new THREE.Vector2((2 * (x - canvas.left)) / canvas.width - 1, 1 - (2 * (y - canvas.top)) / canvas.height);
    caster.setFromCamera(place, this.rig.camera);
    return pick(caster.ray, this.bodies, this.batches, this.level.group);
  }

  // Where a point of the world is on the screen, or null where it is behind.
  project(x: number, y: number, z: number): { x: number; y: number } | null {
    const point = new THREE.Vector3(x, y, z).project(this.rig.camera);
    if (point.z > 1) return null;
    return { x: ((point.x + 1) / 2) * this.size.width, y: ((1 - point.y) / 2) * this.size.height };
  }

  resize(width: number, height: number): void {
    this.size = { width, height };
    this.renderer.setSize(width, height, false);
    this.rig.camera.aspect = width / Math.max(1, height);
    this.rig.camera.updateProjectionMatrix();
  }

  // The page's own work for a picture: colours, camera.
  update(now_s: number): void {
    if (this.bodies.shown !== this.posed) {
      this.posed = this.bodies.shown;
      this.batches.posed();
      if (this.mode === 'speed') this.recolourAll();
    }
    this.fade(now_s);
    this.contacts.fade(now_s);
    this.mark(now_s);
    this.rig.controls.update();
    this.rig.adapt();
    const { camera } = this.rig;
    this.batches.judge(camera.position, (0.5 * this.renderer.domElement.height) / Math.tan((0.5 * camera.fov * Math.PI) / 180));
  }

  render(): void {
    if (this.sun.castShadow) this.aimSun();
    this.light.follow(this.sky, this.sun, this.scene.fog as THREE.Fog);
    this.renderer.render(this.scene, this.rig.camera);
  }

  private drawTerritory(): void {
    if (this.map) this.territory.draw(this.map, this.bounds, this.dead, this.theme);
  }

  // Plain light has no shadows, and costs no more than the processor can draw.
  private setPlain(on: boolean): void {
    this.batches.setPlain(on);
    this.level.setPlain(on);
    this.territory.setPlain(on);
  }

  private setFog(): void {
    const extent = Math.max(this.bounds[3]! - this.bounds[0]!, this.bounds[5]! - this.bounds[2]!);
    this.scene.fog = new THREE.Fog(this.theme.background, 1.5 * extent, 4 * extent);
    this.sun.position.set(0.35 * extent, 0.8 * extent, 0.25 * extent);
  }

  private recolour(slot: number): void {
    const colour = bodyColour(this.bodies, slot, this.mode, this.dead, this.values);
    this.batches.setColour(slot, colour[0]!, colour[1]!, colour[2]!);
  }

  private recolourAll(): void {
    for (let place = 0; place < this.bodies.count; ++place) {
      const slot = this.bodies.order[place]!;
      if (!this.flashes.has(slot)) this.recolour(slot);
    }
  }

  private fade(now_s: number): void {
    for (const [slot, begin_s] of this.flashes) {
      const white = 1 - (now_s - begin_s) / FLASH_S;
      if (white <= 0) {
        this.flashes.delete(slot);
        this.recolour(slot);
        continue;
      }
      const [red, green, blue] = bodyColour(this.bodies, slot, this.mode, this.dead, this.values) as [number, number, number];
      this.batches.setColour(slot, red + (1 - red) * white, green + (1 - green) * white, blue + (1 - blue) * white);
    }
  }

  private mark(now_s: number): void {
    const { shown } = this.bodies;
    const slot = this.selected;
    this.outline.visible = slot >= 0;
    if (slot >= 0) {
      const box = this.batches.geometryOf(slot)?.boundingBox;
      if (box) {
        this.outline.position.fromArray(shown, POSE_PARTS * slot);
        this.outline.quaternion.fromArray(shown, POSE_PARTS * slot + TURN);
        box.getSize(this.outline.scale).addScalar(0.12);
        this.outline.position.add(box.getCenter(new THREE.Vector3()).applyQuaternion(this.outline.quaternion));
      }
    }
    this.arrow.visible = this.own >= 0;
    if (this.own >= 0) {
      const at = POSE_PARTS * this.own;
      this.arrow.position.set(shown[at]!, shown[at + 1]! + 1.9 + 0.12 * Math.sin(5 * now_s), shown[at + 2]!);
    }
    const lead = this.follows ? (slot >= 0 ? slot : this.own) : -1;
    if (lead >= 0) this.rig.follow(shown[POSE_PARTS * lead]!, shown[POSE_PARTS * lead + 1]!, shown[POSE_PARTS * lead + 2]!);
    else this.rig.stopFollowing();
  }

  // Shadows fall where one looks.
  private aimSun(): void {
    const target = this.rig.controls.target;
    const reach = Math.min(220, 0.75 * this.rig.camera.position.distanceTo(target) + 10);
    const sun = this.sun;
    sun.target.position.copy(target);
    sun.position.set(target.x + 0.8 * reach, target.y + 1.7 * reach, target.z + 0.5 * reach);
    const camera = sun.shadow.camera;
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.1;
    camera.far = 5 * reach;
    camera.updateProjectionMatrix();
  }
}

function makeOutline(): THREE.LineSegments {
  const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1));
  const outline = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: '#ffffff', depthTest: false }));
  outline.visible = false;
  outline.renderOrder = 2;
  return outline;
}

function makeArrow(): THREE.Mesh {
  const arrow = new THREE.Mesh(
    new THREE.ConeGeometry(0.32, 0.7, 4).rotateX(Math.PI),
    new THREE.MeshBasicMaterial({ color: '#ffffff' }),
  );
  arrow.visible = false;
  return arrow;
}

// Without a graphics card every pixel costs processor time, so edges are not smoothed there.
function drawsInSoftware(): boolean {
  const context = document.createElement('canvas').getContext('webgl2');
  if (!context) return false;
  const extension = context.getExtension('WEBGL_debug_renderer_info');
  const name = String(context.getParameter(extension ? extension.UNMASKED_RENDERER_WEBGL : context.RENDERER));
  context.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

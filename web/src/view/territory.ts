// Territory: who owns which part of the ground. A picture of the map from above, which the materials of all static bodies
// look up, so that it lies on level ground and on hills alike; and a curtain of light along each border.

import * as THREE from 'three';
import type { Cell, PartitionMap } from '../protocol/messages.ts';
import { regionColour, regionCss } from './colours.ts';

// Pixels of the picture. It is drawn anew whenever a region dies or comes back, just when bodies are to move again, so
// that without a graphics card it must cost no more than a picture of the world does.
const LONG_SIDE = 2048;
const LONG_SIDE_IN_SOFTWARE = 1024;
const DEAD = '#7c8290';

export interface Theme {
  ground: string;
  level: string;
  background: string;
  ink: string;
}

export class Territory {
  readonly curtains = new THREE.Group();
  // The part of x and z that the picture covers: minimum x, minimum z, 1 / width, 1 / depth.
  readonly area = new THREE.Vector4(0, 0, 1, 1);
  private readonly canvas = document.createElement('canvas');
  private readonly context: CanvasRenderingContext2D;
  private readonly scale: number; // widths of lines are multiplied by it, so that they are alike on the ground
  readonly texture = new THREE.CanvasTexture(this.canvas);

  constructor(software: boolean) {
    this.scale = software ? LONG_SIDE_IN_SOFTWARE / LONG_SIDE : 1;
    // Without a card the browser would draw lines and letters by the shaders of an emulated one.
    this.context = this.canvas.getContext('2d', { willReadFrequently: software })!;
    this.texture.anisotropy = software ? 1 : 8;
    this.texture.colorSpace = THREE.SRGBColorSpace;
    this.texture.flipY = false;
    this.texture.generateMipmaps = true;
    this.texture.minFilter = THREE.LinearMipmapLinearFilter;
    this.texture.wrapS = this.texture.wrapT = THREE.ClampToEdgeWrapping;
  }

  // Plain light takes colours as the screen is told, and what is cheap to look up: the level of detail is not blended.
  setPlain(on: boolean): void {
    this.texture.colorSpace = on ? THREE.NoColorSpace : THREE.SRGBColorSpace;
    this.texture.minFilter = on ? THREE.LinearMipmapNearestFilter : THREE.LinearMipmapLinearFilter;
    this.texture.dispose();
    this.texture.needsUpdate = this.canvas.width > 0;
  }

  draw(map: PartitionMap, bounds: number[], dead: ReadonlySet<number>, theme: Theme): void {
    const [min_x, , min_z, max_x, , max_z] = bounds as [number, number, number, number, number, number];
    const width_m = Math.max(1e-3, max_x - min_x);
    const depth_m = Math.max(1e-3, max_z - min_z);
    this.area.set(min_x, min_z, 1 / width_m, 1 / depth_m);
    const pixels = (this.scale * LONG_SIDE) / Math.max(width_m, depth_m); // a metre
    const width = Math.max(2, Math.round(width_m * pixels));
    const height = Math.max(2, Math.round(depth_m * pixels));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.texture.dispose();
    }
    const { context, scale } = this;
    context.fillStyle = theme.ground;
    context.fillRect(0, 0, width, height);
    const x = (value: number) => (value - min_x) * pixels;
    const z = (value: number) => (value - min_z) * pixels;
    for (const cell of map.cells) {
      context.globalAlpha = dead.has(cell.owner) ? 0.1 : 0.2;
      context.fillStyle = dead.has(cell.owner) ? DEAD : regionCss(cell.owner);
      context.fillRect(x(cell.min_x), z(cell.min_z), x(cell.max_x) - x(cell.min_x), z(cell.max_z) - z(cell.min_z));
      if (dead.has(cell.owner)) hatch(context, x(cell.min_x), z(cell.min_z), x(cell.max_x), z(cell.max_z), scale);
    }
    grid(context, bounds, pixels, scale, theme);
    for (const region of map.regions) label(context, map, region, dead, x, z, theme);
    this.texture.needsUpdate = true;
    this.hang(map.cells, bounds, dead);
  }

  private hang(cells: Cell[], bounds: number[], dead: ReadonlySet<number>): void {
    for (const child of [...this.curtains.children] as THREE.Mesh[]) {
      child.geometry.dispose();
      this.curtains.remove(child);
    }
    const extent = Math.max(bounds[3]! - bounds[0]!, bounds[5]! - bounds[2]!);
    const positions: number[] = [];
    const colours: number[] = [];
    const height = Math.min(0.03 * extent, 6);
    const base = Math.max(bounds[1]!, -5);
    for (const edge of borders(cells)) {
      const sides = [edge.a, edge.b].map((region) => (dead.has(region) ? [0.2, 0.2, 0.22] : regionColour(region)));
      const colour = sides[0]!.map((part, index) => (part + sides[1]![index]!) / 2);
      const corners: [number, number, number, number][] = [
        [edge.x0, base, edge.z0, 0.55],
        [edge.x1, base, edge.z1, 0.55],
        [edge.x1, height, edge.z1, 0],
        [edge.x0, height, edge.z0, 0],
      ];
      for (const index of [0, 1, 2, 0, 2, 3]) {
        const [px, py, pz, alpha] = corners[index]!;
        positions.push(px, py, pz);
        colours.push(...colour, alpha);
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 4));
    const material = new THREE.MeshBasicMaterial({
      vertexColors: true,
      transparent: true,
      depthWrite: false,
      side: THREE.DoubleSide,
    });
    this.curtains.add(new THREE.Mesh(geometry, material));
  }
}

interface Border {
  a: number;
  b: number;
  x0: number;
  z0: number;
  x1: number;
  z1: number;
}

// The edges that cells of different owners share.
export function borders(cells: Cell[]): Border[] {
  const found: Border[] = [];
  for (const a of cells) {
    for (const b of cells) {
      if (a.owner === b.owner) continue;
      if (a.max_x === b.min_x) {
        const z0 = Math.max(a.min_z, b.min_z);
        const z1 = Math.min(a.max_z, b.max_z);
        if (z0 < z1) found.push({ a: a.owner, b: b.owner, x0: a.max_x, z0, x1: a.max_x, z1 });
      }
      if (a.max_z === b.min_z) {
        const x0 = Math.max(a.min_x, b.min_x);
        const x1 = Math.min(a.max_x, b.max_x);
        if (x0 < x1) found.push({ a: a.owner, b: b.owner, x0, z0: a.max_z, x1, z1: a.max_z });
      }
    }
  }
  return found;
}

function hatch(context: CanvasRenderingContext2D, x0: number, z0: number, x1: number, z1: number, scale: number): void {
  context.save();
  context.beginPath();
  context.rect(x0, z0, x1 - x0, z1 - z0);
  context.clip();
  context.globalAlpha = 0.16;
  context.strokeStyle = DEAD;
  context.lineWidth = 10 * scale;
  for (let at = x0 - (z1 - z0); at < x1; at += 36 * scale) {
    context.beginPath();
    context.moveTo(at, z1);
    context.lineTo(at + (z1 - z0), z0);
    context.stroke();
  }
  context.restore();
}

// The grid's step is a power of ten that leaves lines far enough apart to be told apart.
export function gridStep(extent_m: number): number {
  return Math.max(1, 10 ** Math.floor(Math.log10(extent_m / 8)));
}

function grid(context: CanvasRenderingContext2D, bounds: number[], pixels: number, scale: number, theme: Theme): void {
  const extent = Math.max(bounds[3]! - bounds[0]!, bounds[5]! - bounds[2]!);
  const coarse = gridStep(extent);
  context.strokeStyle = theme.ink;
  for (const step of [coarse / 5, coarse]) {
    if (step * pixels < 12 * scale) continue;
    context.globalAlpha = step === coarse ? 0.17 : 0.06;
    context.lineWidth = (step === coarse ? 2.5 : 1.5) * scale;
    context.beginPath();
    for (let at = Math.ceil(bounds[0]! / step) * step; at <= bounds[3]!; at += step) {
      context.moveTo((at - bounds[0]!) * pixels, 0);
      context.lineTo((at - bounds[0]!) * pixels, context.canvas.height);
    }
    for (let at = Math.ceil(bounds[2]! / step) * step; at <= bounds[5]!; at += step) {
      context.moveTo(0, (at - bounds[2]!) * pixels);
      context.lineTo(context.canvas.width, (at - bounds[2]!) * pixels);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

function label(
  context: CanvasRenderingContext2D,
  map: PartitionMap,
  region: PartitionMap['regions'][number],
  dead: ReadonlySet<number>,
  x: (value: number) => number,
  z: (value: number) => number,
  theme: Theme,
): void {
  let widest: Cell | null = null;
  const side = (cell: Cell) => Math.min(cell.max_x - cell.min_x, cell.max_z - cell.min_z);
  for (const cell of map.cells) {
    if (cell.owner === region.region && (!widest || side(cell) > side(widest))) widest = cell;
  }
  if (!widest) return;
  const size = x(widest.min_x + side(widest)) - x(widest.min_x);
  const left = x(widest.min_x) + 0.07 * size;
  const bottom = z(widest.max_z) - 0.07 * size;
  context.save();
  context.fillStyle = dead.has(region.region) ? DEAD : regionCss(region.region);
  context.textBaseline = 'alphabetic';
  context.globalAlpha = 0.85;
  context.font = `700 ${0.18 * size}px system-ui, sans-serif`;
  context.fillText(String(region.region), left, bottom);
  const after = left + context.measureText(String(region.region)).width + 0.035 * size;
  context.font = `500 ${0.052 * size}px system-ui, sans-serif`;
  context.globalAlpha = 0.7;
  context.fillStyle = theme.ink;
  context.fillText(region.host, after, bottom - 0.085 * size);
  const below = dead.has(region.region) ? 'lost' : region.standby ? `standby ${region.standby}` : 'no standby';
  context.fillText(below, after, bottom - 0.005 * size);
  context.restore();
}

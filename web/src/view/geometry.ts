// Geometry of each shape of the scene format, in the body's own frame.

import * as THREE from 'three';
import { mergeGeometries, mergeVertices } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import type { Shape } from '../protocol/messages.ts';

const PLANE_HALF_M = 2000;

export type ShapeTable = Map<number, Shape>;

// How round what is round is drawn: a large part of a level or a body nearby, down to one of many bodies far away.
export type Detail = 'fine' | 'usual' | 'coarse' | 'far' | 'speck';
export const DETAILS: readonly Detail[] = ['fine', 'usual', 'coarse', 'far', 'speck'];

// Sides of a circle, rings of a capsule's end, how often the faces of an icosahedron are parted (-1: an octahedron); how much larger the shape
// is drawn, so that it covers as many pixels as a round one; and the most pixels that its radius has on the screen then, so
// that its outline is off by about one.
const ROUND = {
  fine: { sides: 24, rings: 8, parted: 4, swell: 1, pixels: Infinity },
  usual: { sides: 14, rings: 4, parted: 2, swell: 1, pixels: 50 },
  coarse: { sides: 8, rings: 2, parted: 1, swell: 1.04, pixels: 14 },
  far: { sides: 5, rings: 1, parted: 0, swell: 1.14, pixels: 5 },
  speck: { sides: 4, rings: 1, parted: -1, swell: 1.3, pixels: 2.5 },
};

const STAYS = 1.15; // a body has to be so much larger or smaller than the bound to leave its detail

// The place in DETAILS of the right one for a body of this radius on the screen, which has had another one.
export function detailFor(pixels: number, had: number): number {
  for (let at = DETAILS.length - 1; at > 0; --at) {
    const bound = ROUND[DETAILS[at]!].pixels;
    if (pixels < (at <= had ? bound * STAYS : bound / STAYS)) return at;
  }
  return 0;
}

// Whether its geometry depends on the detail.
export function isRound(shape: Shape, table: ShapeTable): boolean {
  if (shape.kind === 'compound') return shape.children.some(({ shape: child }) => table.has(child) && isRound(table.get(child)!, table));
  return shape.kind === 'sphere' || shape.kind === 'capsule' || shape.kind === 'cylinder' || shape.kind === 'cone';
}

export function makeGeometry(shape: Shape, table: ShapeTable, detail: Detail): THREE.BufferGeometry {
  const { sides, rings, parted, swell } = ROUND[detail];
  switch (shape.kind) {
    case 'box':
      return new THREE.BoxGeometry(2 * shape.half[0]!, 2 * shape.half[1]!, 2 * shape.half[2]!);
    case 'sphere':
      return sphere(swell * shape.radius, parted);
    case 'capsule':
      return new THREE.CapsuleGeometry(swell * shape.radius, 2 * shape.half_height, rings, sides);
    case 'cylinder':
      return new THREE.CylinderGeometry(swell * shape.radius, swell * shape.radius, 2 * shape.half_height, sides);
    case 'cone':
      return new THREE.ConeGeometry(swell * shape.radius, shape.height, sides);
    case 'hull':
    case 'mesh':
      return triangles(shape.vertices, shape.triangles);
    case 'compound':
      return compound(shape.children, table, detail);
    case 'field':
      return field(shape);
    case 'plane':
      return plane(shape.normal, shape.offset);
  }
}

// Each corner once: three.js gives each face its own.
function sphere(radius: number, parted: number): THREE.BufferGeometry {
  const faces = parted < 0 ? new THREE.OctahedronGeometry(radius) : new THREE.IcosahedronGeometry(radius, parted);
  faces.deleteAttribute('uv');
  return mergeVertices(faces);
}

// Faces with one normal each, as a collision shape is.
function triangles(vertices: Float32Array, indices: Uint32Array): THREE.BufferGeometry {
  const indexed = new THREE.BufferGeometry();
  indexed.setAttribute('position', new THREE.BufferAttribute(vertices, 3));
  indexed.setIndex(new THREE.BufferAttribute(indices, 1));
  const flat = indexed.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

function compound(
  children: { shape: number; position: number[]; orientation: number[] }[],
  table: ShapeTable,
  detail: Detail,
): THREE.BufferGeometry {
  const parts: THREE.BufferGeometry[] = [];
  for (const child of children) {
    const shape = table.get(child.shape);
    if (!shape) continue;
    const whole = makeGeometry(shape, table, detail);
    const part = whole.index ? whole.toNonIndexed() : whole;
    part.deleteAttribute('uv');
    part.applyMatrix4(
      new THREE.Matrix4().compose(
        new THREE.Vector3(...child.position),
        new THREE.Quaternion(...child.orientation),
        new THREE.Vector3(1, 1, 1),
      ),
    );
    parts.push(part);
  }
  return parts.length === 0 ? new THREE.BufferGeometry() : mergeVertices(mergeGeometries(parts));
}

// The samples of the rim give the edge the slope of the whole field, and are not drawn: where two parts meet the light
// has no seam.
function field(shape: Shape & { kind: 'field' }): THREE.BufferGeometry {
  const { columns, rows, spacing, rim, heights } = shape;
  const [left, right, near, far] = [0, 1, 2, 3].map((bit) => (rim >> bit) & 1) as [number, number, number, number];
  const wide = columns + left + right;
  const deep = rows + near + far;
  const positions = new Float32Array(3 * wide * deep);
  for (let row = 0, at = 0; row < deep; ++row) {
    for (let column = 0; column < wide; ++column, ++at) {
      positions[3 * at] = (column - left - (columns - 1) / 2) * spacing;
      positions[3 * at + 1] = heights[at]!;
      positions[3 * at + 2] = (row - near - (rows - 1) / 2) * spacing;
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setIndex(cells(wide, 0, 0, wide - 1, deep - 1));
  geometry.computeVertexNormals();
  if (rim !== 0) geometry.setIndex(cells(wide, left, near, columns - 1, rows - 1));
  return geometry;
}

// Two triangles for each of `across` x `along` cells from a corner on, of a grid that is `wide` samples wide.
function cells(wide: number, column: number, row: number, across: number, along: number): THREE.BufferAttribute {
  const indices = new Uint32Array(6 * across * along);
  let at = 0;
  for (let z = row; z < row + along; ++z) {
    for (let x = column; x < column + across; ++x, at += 6) {
      const corner = z * wide + x;
      indices.set([corner, corner + wide, corner + 1, corner + 1, corner + wide, corner + wide + 1], at);
    }
  }
  return new THREE.BufferAttribute(indices, 1);
}

function plane(normal: number[], offset: number): THREE.BufferGeometry {
  const up = new THREE.Vector3(...normal).normalize();
  const geometry = new THREE.PlaneGeometry(2 * PLANE_HALF_M, 2 * PLANE_HALF_M);
  geometry.applyQuaternion(new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), up));
  return geometry.translate(up.x * offset, up.y * offset, up.z * offset);
}

// Geometry of each shape of the scene format, in the body's own frame.

import * as THREE from 'three';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import type { Shape } from '../protocol/messages.ts';

const PLANE_HALF_M = 2000;

export type ShapeTable = Map<number, Shape>;

export function makeGeometry(shape: Shape, table: ShapeTable, fine: boolean): THREE.BufferGeometry {
  const round = fine ? 24 : 14;
  switch (shape.kind) {
    case 'box':
      return new THREE.BoxGeometry(2 * shape.half[0]!, 2 * shape.half[1]!, 2 * shape.half[2]!);
    case 'sphere':
      return fine ? new THREE.SphereGeometry(shape.radius, 24, 16) : new THREE.IcosahedronGeometry(shape.radius, 2);
    case 'capsule':
      return new THREE.CapsuleGeometry(shape.radius, 2 * shape.half_height, fine ? 8 : 4, round);
    case 'cylinder':
      return new THREE.CylinderGeometry(shape.radius, shape.radius, 2 * shape.half_height, round);
    case 'cone':
      return new THREE.ConeGeometry(shape.radius, shape.height, round);
    case 'hull':
    case 'mesh':
      return triangles(shape.vertices, shape.triangles);
    case 'compound':
      return compound(shape.children, table, fine);
    case 'field':
      return field(shape.columns, shape.rows, shape.spacing, shape.heights);
    case 'plane':
      return plane(shape.normal, shape.offset);
  }
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
  fine: boolean,
): THREE.BufferGeometry {
  const parts: THREE.BufferGeometry[] = [];
  for (const child of children) {
    const shape = table.get(child.shape);
    if (!shape) continue;
    const whole = makeGeometry(shape, table, fine);
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
  return parts.length === 0 ? new THREE.BufferGeometry() : mergeGeometries(parts);
}

function field(columns: number, rows: number, spacing: number, heights: Float32Array): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  const positions = new Float32Array(3 * columns * rows);
  for (let row = 0, at = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column, ++at) {
      positions[3 * at] = (column - (columns - 1) / 2) * spacing;
      positions[3 * at + 1] = heights[at]!;
      positions[3 * at + 2] = (row - (rows - 1) / 2) * spacing;
    }
  }
  const indices = new Uint32Array(6 * (columns - 1) * (rows - 1));
  let at = 0;
  for (let row = 0; row + 1 < rows; ++row) {
    for (let column = 0; column + 1 < columns; ++column) {
      const corner = row * columns + column;
      indices.set([corner, corner + columns, corner + 1, corner + 1, corner + columns, corner + columns + 1], at);
      at += 6;
    }
  }
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setIndex(new THREE.BufferAttribute(indices, 1));
  geometry.computeVertexNormals();
  return geometry;
}

function plane(normal: number[], offset: number): THREE.BufferGeometry {
  const up = new THREE.Vector3(...normal).normalize();
  const geometry = new THREE.PlaneGeometry(2 * PLANE_HALF_M, 2 * PLANE_HALF_M);
  geometry.applyQuaternion(new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), up));
  return geometry.translate(up.x * offset, up.y * offset, up.z * offset);
}

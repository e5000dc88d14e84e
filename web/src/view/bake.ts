// Baking: geometries that never move, in one, so that they are drawn together.

import * as THREE from 'three';

export interface Placed {
  geometry: THREE.BufferGeometry;
  matrix: THREE.Matrix4; // a rotation and a translation
}

// Vertices that it has when it is baked.
export function bakedSize(geometry: THREE.BufferGeometry): number {
  return geometry.getAttribute('position')?.count ?? 0;
}

// Positions and normals of all, in the world's frame, with one index; colours and paint where all have them.
export function bake(placed: Placed[]): THREE.BufferGeometry {
  const vertices = placed.reduce((sum, { geometry }) => sum + bakedSize(geometry), 0);
  const corners = placed.reduce((sum, { geometry }) => sum + (geometry.index?.count ?? bakedSize(geometry)), 0);
  const positions = new Float32Array(3 * vertices);
  const normals = new Float32Array(3 * vertices);
  const index = new Uint32Array(corners);
  const coloured = placed.every(({ geometry }) => geometry.hasAttribute('color'));
  const colours = new Float32Array(coloured ? 3 * vertices : 0);
  const painted = placed.every(({ geometry }) => geometry.hasAttribute('paint'));
  const paint = new Float32Array(painted ? 3 * vertices : 0);
  let vertex = 0;
  let corner = 0;
  for (const { geometry, matrix } of placed) {
    const size = bakedSize(geometry);
    if (size === 0) continue;
    write(geometry.getAttribute('position').array, matrix, 1, positions, 3 * vertex);
    write(geometry.getAttribute('normal').array, matrix, 0, normals, 3 * vertex);
    if (coloured) colours.set(geometry.getAttribute('color').array, 3 * vertex);
    if (painted) paint.set(geometry.getAttribute('paint').array, 3 * vertex);
    const own = geometry.index?.array;
    const count = own?.length ?? size;
    for (let at = 0; at < count; ++at) index[corner + at] = vertex + (own ? own[at]! : at);
    corner += count;
    vertex += size;
  }
  const baked = new THREE.BufferGeometry();
  baked.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  baked.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  if (coloured) baked.setAttribute('color', new THREE.BufferAttribute(colours, 3));
  if (painted) baked.setAttribute('paint', new THREE.BufferAttribute(paint, 3));
  baked.setIndex(new THREE.BufferAttribute(index, 1));
  return baked;
}

// `w`: 1 for places, 0 for directions.
function write(from: ArrayLike<number>, matrix: THREE.Matrix4, w: number, out: Float32Array, begin: number): void {
  const m = matrix.elements;
  for (let at = 0; at < from.length; at += 3) {
    const x = from[at]!;
    const y = from[at + 1]!;
    const z = from[at + 2]!;
    out[begin + at] = m[0]! * x + m[4]! * y + m[8]! * z + w * m[12]!;
    out[begin + at + 1] = m[1]! * x + m[5]! * y + m[9]! * z + w * m[13]!;
    out[begin + at + 2] = m[2]! * x + m[6]! * y + m[10]! * z + w * m[14]!;
  }
}

// Levels of many bodies: what is drawn is all there is, in few calls, and adding is linear.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as THREE from 'three';
import type { Shape, StaticBody } from '../src/protocol/messages.ts';
import { makeGeometry } from '../src/view/geometry.ts';
import { Level } from '../src/view/level.ts';

const SLOWNESS = Number(process.env['TESSERA_SLOWNESS'] ?? '1');
const UPRIGHT = [0, 0, 0, 1];

function makeLevel(): Level {
  return new Level({ texture: new THREE.CanvasTexture(null as unknown as HTMLCanvasElement), area: new THREE.Vector4() });
}

function body(id: number, shape: number, position: number[], orientation = UPRIGHT): StaticBody {
  return { body: String(id), name: `part-${id}`, shape, trigger: false, position, orientation };
}

// A strip of `count` triangles.
function strip(count: number): Shape {
  const vertices = new Float32Array(3 * (count + 2));
  for (let at = 0; at < count + 2; ++at) vertices.set([at >> 1, 0, at & 1], 3 * at);
  const triangles = new Uint32Array(3 * count);
  for (let at = 0; at < count; ++at) triangles.set(at % 2 === 0 ? [at, at + 1, at + 2] : [at + 1, at, at + 2], 3 * at);
  return { kind: 'mesh', vertices, triangles };
}

function drawn(level: Level): { calls: number; triangles: number } {
  const meshes = level.group.children.filter((child) => child.visible) as THREE.Mesh[];
  const floor = 1;
  const corners = meshes.slice(floor).map((mesh) => {
    const of = mesh.geometry.index?.count ?? mesh.geometry.getAttribute('position').count;
    return mesh instanceof THREE.InstancedMesh ? of * mesh.count : of;
  });
  return { calls: meshes.length, triangles: corners.reduce((sum, count) => sum + count, 0) / 3 };
}

test('200 000 triangles of 4000 nodes are drawn in a few calls', () => {
  const shapes = new Map<number, Shape>();
  const level = makeLevel();
  for (let message = 0; message < 10; ++message) {
    const statics: StaticBody[] = [];
    for (let at = 400 * message; at < 400 * (message + 1); ++at) {
      shapes.set(at + 1, strip(50));
      statics.push(body(at, at + 1, [30 * (at % 60), 1, 2 * Math.floor(at / 60)]));
    }
    level.add(statics, shapes);
  }
  assert.equal(level.count, 4000);
  const { calls, triangles } = drawn(level);
  assert.equal(triangles, 200_000);
  assert.ok(calls <= 11, `${calls} calls`);
});

test('bodies of one shape are instances, where they are', () => {
  const shapes = new Map<number, Shape>([[1, { kind: 'box', half: [1, 2, 3] }]]);
  const level = makeLevel();
  level.add(Array.from({ length: 5000 }, (_, at) => body(at, 1, [3 * at, 5, -7])), shapes);
  assert.deepEqual([drawn(level).calls, drawn(level).triangles], [2, 12 * 5000]);
  const box = new THREE.Box3().setFromObject(level.group.children[1]!);
  assert.deepEqual([box.min.toArray(), box.max.toArray()], [[-1, 3, -10], [3 * 4999 + 1, 7, -4]]);
});

test('a baked body is where it stands, turned as it is', () => {
  const level = makeLevel();
  const quarter = [0, Math.SQRT1_2, 0, Math.SQRT1_2]; // about y: x goes to -z
  level.add([body(1, 1, [10, 20, 30], quarter)], new Map([[1, { kind: 'box', half: [1, 2, 3] }]]));
  const mesh = level.group.children[1] as THREE.Mesh;
  const box = new THREE.Box3().setFromObject(mesh);
  const round = (point: THREE.Vector3) => point.toArray().map((part) => Math.round(1000 * part) / 1000);
  assert.deepEqual([round(box.min), round(box.max)], [[7, 18, 29], [13, 22, 31]]);
  const normals = mesh.geometry.getAttribute('normal');
  for (let at = 0; at < normals.count; ++at) {
    const length = Math.hypot(normals.getX(at), normals.getY(at), normals.getZ(at));
    assert.ok(Math.abs(length - 1) < 1e-5);
  }
});

test('adding is linear: 40 000 bodies in 400 messages take no longer than a few seconds', () => {
  const shapes = new Map<number, Shape>([[1, { kind: 'box', half: [1, 1, 1] }]]);
  const level = makeLevel();
  const begin = performance.now();
  for (let at = 0; at < 40_000; at += 100) {
    level.add(Array.from({ length: 100 }, (_, index) => body(at + index, 1, [at + index, 1, 0])), shapes);
  }
  const took_s = (performance.now() - begin) / 1000;
  assert.equal(level.count, 40_000);
  assert.ok(took_s < 5 * SLOWNESS, `${took_s} s`);
});

test('the floor lies below all there is, and a plane needs none', () => {
  const shapes = new Map<number, Shape>([
    [1, { kind: 'box', half: [1, 2, 1] }],
    [2, { kind: 'plane', normal: [0, 1, 0], offset: 0 }],
  ]);
  const level = makeLevel();
  const floor = level.group.children[0]!;
  level.add([body(1, 1, [0, -3, 0]), body(2, 1, [0, 9, 0])], shapes);
  assert.ok(floor.visible);
  assert.ok(Math.abs(floor.position.y + 5.02) < 1e-6, `${floor.position.y}`);
  level.add([body(3, 2, [0, 0, 0])], shapes);
  assert.equal(floor.visible, false);
  level.clear();
  assert.deepEqual([level.count, level.group.children.length, floor.visible, floor.position.y], [0, 1, true, 0]);
});

test('what a tile brought goes with it, and nothing else', () => {
  const shapes = new Map<number, Shape>([
    [1, { kind: 'box', half: [1, 1, 1] }],
    [2, strip(50)],
    [3, strip(70)],
  ]);
  const level = makeLevel();
  level.add([body(1, 1, [0, 0, 0])], shapes);
  level.add([body(2, 2, [0, 0, 0]), ...Array.from({ length: 9 }, (_, at) => body(10 + at, 1, [at, 0, 0]))], shapes, 0);
  level.add([body(2, 3, [0, 0, 0])], shapes, 7);
  assert.equal(level.count, 12);
  assert.equal(drawn(level).triangles, 12 * 10 + 50 + 70);
  level.drop(0);
  assert.equal(level.count, 2);
  assert.equal(drawn(level).triangles, 12 + 70);
  level.drop(0);
  level.drop(7);
  assert.deepEqual([level.count, drawn(level).triangles], [1, 12]);
});

test('where two parts of a height field meet, the light has no seam', () => {
  const height = (x: number, z: number) => Math.sin(x / 3) + Math.cos(z / 2) * x * 0.1;
  const part = (rim: number, first: number, last: number): Shape => {
    const heights = [];
    for (let z = 0; z < 9; ++z) for (let x = first; x <= last; ++x) heights.push(height(x, z));
    return { kind: 'field', columns: 9, rows: 9, spacing: 2, rim, heights: new Float32Array(heights) };
  };
  const edge = (shape: Shape, x: number) => {
    const geometry = makeGeometry(shape, new Map(), 'fine');
    const positions = geometry.getAttribute('position');
    const normals = geometry.getAttribute('normal');
    const rows = [];
    for (const at of new Set(geometry.index!.array)) {
      if (positions.getX(at) === x) rows.push([positions.getZ(at), positions.getY(at), normals.getX(at), normals.getY(at), normals.getZ(at)]);
    }
    return { rows: rows.sort((a, b) => a[0]! - b[0]!), triangles: geometry.index!.count / 3 };
  };
  // Samples 0 to 8 and 8 to 16, each centred: the last of one is the first of the other.
  const left = edge(part(2, 0, 9), 8);
  const right = edge(part(1, 7, 16), -8);
  assert.equal(left.rows.length, 9);
  assert.deepEqual(left, right);
  assert.equal(left.triangles, 2 * 8 * 8);
  assert.notDeepEqual(edge(part(0, 0, 8), 8).rows, edge(part(0, 8, 16), -8).rows);
});

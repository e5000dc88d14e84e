// Mesh files: read where they are whole, refused in a line where they are not, and drawn for the shapes that name them.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as THREE from 'three';
import { GlbError, MOST_TRIANGLES, parseGlb } from '../src/protocol/glb.ts';
import type { Shape, ShapeVisuals, StaticBody } from '../src/protocol/messages.ts';
import { Level } from '../src/view/level.ts';
import { LAYER_PIXELS, Pictures } from '../src/view/pictures.ts';
import { type Meshes, Visuals, askFor } from '../src/view/visuals.ts';
import { makeGlb, makePng, pyramid } from '../testing/glb_file.ts';

const UPRIGHT = [0, 0, 0, 1];
const HASH = 'a'.repeat(64);

function buffer(bytes: Buffer): ArrayBuffer {
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length) as ArrayBuffer;
}

const parse = (bytes: Buffer) => parseGlb(buffer(bytes));

function fault(bytes: Buffer): string {
  try {
    parse(bytes);
  } catch (error) {
    assert.ok(error instanceof GlbError, String(error));
    return error.message;
  }
  return '';
}

test('a mesh comes with its triangles, normals and colour', () => {
  const square = { positions: [0, 0, 0, 0, 0, 1, 1, 0, 0], indices: [0, 1, 2], normals: [0, 1, 0, 0, 1, 0, 0, 1, 0] };
  const [first, second] = parse(makeGlb([pyramid(3, [0.5, 0.25, 0]), square]));
  assert.equal(first![0]!.positions.length, 15);
  assert.equal(first![0]!.indices.length, 18);
  assert.equal(first![0]!.normals, null);
  assert.deepEqual(first![0]!.colour, [0.5, 0.25, 0]);
  assert.deepEqual([...second![0]!.normals!], square.normals);
  assert.deepEqual(second![0]!.colour, [1, 1, 1]);
});

test('a primitive has the colours of its vertices, and the picture of its material', () => {
  const picture = makePng(2, 2, () => [1, 2, 3]);
  const square = { positions: [0, 0, 0, 0, 0, 1, 1, 0, 0], indices: [0, 1, 2], colours: [1, 0, 0, 0, 1, 0, 0, 0, 1], places: [0, 0, 0, 1, 1, 0], picture };
  const [mesh] = parse(makeGlb([square]));
  assert.deepEqual([...mesh![0]!.colours!], square.colours);
  assert.deepEqual([...mesh![0]!.places!], square.places);
  assert.deepEqual(Buffer.from(mesh![0]!.picture!), picture);
  const { places, ...bare } = square;
  const [without] = parse(makeGlb([bare]));
  assert.deepEqual([places.length, without![0]!.places, without![0]!.picture], [6, null, null], 'without places it is not painted');
  const broken = (change: (document: any) => void) => fault(makeGlb([square], change));
  assert.match(broken((d) => (d.images[0].uri = 'https://other.example/a.png')), /images\[0\] is another file/);
  assert.equal(parse(makeGlb([square], (d) => delete d.textures[0].source))[0]![0]!.picture, null, 'a picture of a kind that is not known');
  assert.match(broken((d) => (d.textures[0].source = 4)), /images\[4\] is missing/);
  assert.match(broken((d) => (d.textures = [])), /textures\[0\] is missing/);
  assert.match(broken((d) => (d.bufferViews.at(-1).byteLength = 1e6)), /images\[0\] ends beyond its buffer/);
  assert.match(broken((d) => (d.accessors[2].count = 2)), /not as many of COLOR_0 as positions/);
  const bytes = (document: any) => Object.assign(document.accessors[2], { componentType: 5121, type: 'VEC4' });
  const [small] = parse(makeGlb([{ ...square, colours: [1, 0, 0, 0, 0, 0, 0, 0, 0] }], bytes));
  assert.deepEqual([...small![0]!.colours!].slice(0, 3).map((part) => Math.round(255 * part)), [0, 0, 0x80], 'a float, byte by byte');
  assert.match(broken((d) => (d.accessors[3].type = 'VEC3')), /accessors\[3\] has another type/);
});

test('small indices, gaps between vertices and primitives without indices are read', () => {
  const [whole] = parse(makeGlb([pyramid(1)], (document) => delete document.meshes[0].primitives[0].indices));
  assert.deepEqual([...whole![0]!.indices], [0, 1, 2], 'five vertices make one triangle');
  const bytes = makeGlb([{ positions: [0, 0, 0, 9, 9, 9, 1, 0, 0, 9, 9, 9, 0, 0, 1, 9, 9, 9], indices: [0x00020001, 0] }], (document) => {
    document.bufferViews[0].byteStride = 24;
    document.accessors[0].count = 3;
    document.accessors[1].componentType = 5123;
    document.accessors[1].count = 3;
  });
  const [spread] = parse(bytes);
  assert.deepEqual([...spread![0]!.positions], [0, 0, 0, 1, 0, 0, 0, 0, 1]);
  assert.deepEqual([...spread![0]!.indices], [1, 2, 0]);
});

test('a file that the gateway cannot have for the moment is asked for again, and no other', async () => {
  const waited: number[] = [];
  const pause = (ms: number) => Promise.resolve(void waited.push(ms));
  const answers = (...statuses: number[]) => (path: string) => {
    assert.equal(path, '/visuals/a.glb');
    return Promise.resolve(new Response('', { status: statuses.shift()! }));
  };
  assert.equal((await askFor('/visuals/a.glb', answers(503, 503, 200), pause)).status, 200);
  assert.equal(waited.length, 2);
  for (const final of [200, 404, 500]) assert.equal((await askFor('/visuals/a.glb', answers(final), pause)).status, final);
  assert.equal(waited.length, 2);
  assert.equal((await askFor('/visuals/a.glb', answers(...Array<number>(10).fill(503)), pause)).status, 503, 'it ends some time');
  assert.equal(waited.length, 11);
});

test('a file that is damaged is refused in a line', () => {
  const whole = makeGlb([pyramid(1)]);
  assert.equal(fault(whole), '');
  for (let size = 0; size < whole.length; size += 5) assert.notEqual(fault(whole.subarray(0, size)), '', `${size} bytes`);
  const broken = (change: (document: any) => void) => fault(makeGlb([pyramid(1)], change));
  assert.match(broken((d) => (d.accessors[0].count = 6)), /accessors\[0\] ends beyond its buffer/);
  assert.match(broken((d) => (d.accessors[0].count = 1e15)), /ends beyond/);
  assert.match(broken((d) => (d.accessors[0].byteOffset = -4)), /no whole number/);
  assert.match(broken((d) => (d.bufferViews[0].byteStride = 4)), /ends beyond/);
  assert.match(broken((d) => (d.accessors[1].componentType = 5126)), /accessors\[1\] has another type/);
  assert.match(broken((d) => (d.meshes[0].primitives[0].attributes = {})), /accessors\[undefined\] is missing/);
  assert.match(broken((d) => (d.meshes[0].primitives[0].material = 3)), /materials\[3\] is missing/);
  assert.match(broken((d) => (d.meshes[0].primitives[0].mode = 5)), /not that of triangles/);
  assert.match(broken((d) => (d.meshes = 'none')), /meshes is no list/);
  assert.match(broken((d) => (d.accessors[1].sparse = {})), /is sparse/);
  assert.match(fault(makeGlb([{ ...pyramid(1), indices: [0, 1, 5] }])), /index 5 of 5 vertices/);
  assert.match(fault(makeGlb([{ ...pyramid(1), positions: [NaN, 0, 0, 1, 0, 0, 0, 0, 1], indices: [0, 1, 2] }])), /not finite/);
});

test('a file that names another one is refused, so nobody else is asked', () => {
  assert.match(fault(makeGlb([pyramid(1)], (document) => (document.buffers[0].uri = 'https://other.example/a.bin'))), /its buffer is another file/);
});

test('a million triangles are the most', () => {
  const many = { positions: [0, 0, 0, 1, 0, 0, 0, 0, 1], indices: new Array<number>(3 * (MOST_TRIANGLES / 2 + 1)).fill(0) };
  assert.match(fault(makeGlb([many, many])), /more than 1000000 triangles/);
});

// --- Drawn for shapes

const box: Shape = { kind: 'box', half: [1, 1, 1] };

function visual(shape: number, more: Partial<ShapeVisuals['meshes'][0]> = {}): ShapeVisuals {
  return { shape, meshes: [{ sha256: HASH, mesh: 0, position: [0, 0, 0], orientation: UPRIGHT, scale: [1, 1, 1], ...more }] };
}

interface Stage {
  visuals: Visuals;
  problems: string[];
  settled: Promise<number[]>;
}

function stage(load: () => Promise<Meshes>, pictures?: Pictures): Stage {
  const problems: string[] = [];
  let done!: (shapes: number[]) => void;
  const settled = new Promise<number[]>((resolve) => (done = resolve));
  const visuals = new Visuals({ settled: done, problem: (text) => problems.push(text) }, load, pictures);
  return { visuals, problems, settled };
}

test('a mesh is where its visual puts it, and a mirrored one keeps its outside', async () => {
  const { visuals, settled } = stage(async () => parse(makeGlb([pyramid(2, [1, 0, 0])])));
  visuals.add([visual(1, { position: [10, 0, 0], scale: [-2, 1, 1] })]);
  assert.ok(visuals.waits(1));
  assert.deepEqual(await settled, [1]);
  assert.equal(visuals.waits(1), false);
  const geometry = visuals.geometryOf(1)!;
  assert.deepEqual([geometry.boundingBox!.min.toArray(), geometry.boundingBox!.max.toArray()], [[8, 0, -1], [12, 2, 1]]);
  const at = (name: string, corner: number) => new THREE.Vector3().fromBufferAttribute(geometry.getAttribute(name) as THREE.BufferAttribute, geometry.index!.getX(corner));
  for (let corner = 0; corner < geometry.index!.count; corner += 3) {
    const [a, b, c] = [0, 1, 2].map((one) => at('position', corner + one)) as [THREE.Vector3, THREE.Vector3, THREE.Vector3];
    const outward = b.clone().sub(a).cross(c.clone().sub(a));
    const middle = a.clone().add(b).add(c).divideScalar(3).sub(new THREE.Vector3(10, 0.5, 0));
    assert.ok(outward.dot(middle) > 0, `triangle ${corner / 3} looks outward`);
    assert.ok(outward.normalize().distanceTo(at('normal', corner)) < 1e-5, 'and so does its normal');
  }
  assert.deepEqual(at('color', 0).toArray(), [1, 0, 0]);
});

test('a mesh that is not in its file, and a file that cannot be had, leave the shape and are said once', async () => {
  const missing = stage(async () => parse(makeGlb([pyramid(1)])));
  missing.visuals.add([visual(1, { mesh: 7 }), visual(2, { mesh: 7 })]);
  await missing.settled;
  assert.equal(missing.visuals.geometryOf(1), null);
  assert.deepEqual(missing.problems, ['aaaaaaaaaaaa….glb has 1 meshes and no mesh 7. Shapes are drawn in its place.']);
  const lost = stage(() => Promise.reject(new GlbError('--visuals has no file')));
  lost.visuals.add([visual(1), visual(2)]);
  assert.deepEqual(await lost.settled, [1, 2]);
  assert.equal(lost.problems.length, 1);
  assert.match(lost.problems[0]!, /--visuals has no file/);
});

test('vertices say their colour, their place in the picture and its layer', async () => {
  const shade = new Uint8ClampedArray(4 * LAYER_PIXELS * LAYER_PIXELS);
  const picture = makePng(1, 1, () => [9, 9, 9]);
  const square = { positions: [0, 0, 0, 0, 0, 1, 1, 0, 0], normals: [0, 1, 0, 0, 1, 0, 0, 1, 0], indices: [0, 1, 2], places: [0, 0, 0, 1, 1, 0] };
  const glb = makeGlb([{ ...square, colour: [0.5, 1, 1], colours: [1, 1, 0, 1, 1, 0, 1, 1, 0], picture }, square]);
  const { visuals, settled, problems } = stage(async () => parse(glb), new Pictures(async () => shade));
  visuals.add([{ shape: 1, meshes: [visual(1).meshes[0]!, { ...visual(1).meshes[0]!, mesh: 1 }] }]);
  await settled;
  const geometry = visuals.geometryOf(1)!;
  assert.deepEqual([...geometry.getAttribute('color').array].slice(0, 3), [0.5, 1, 0]);
  assert.deepEqual([...geometry.getAttribute('paint').array], [0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, -1, 0, 0, -1, 0, 0, -1]);
  assert.deepEqual(problems, []);
});

test('a picture that cannot be drawn leaves the base colour, and is said once', async () => {
  const square = { positions: [0, 0, 0, 0, 0, 1, 1, 0, 0], indices: [0, 1, 2], places: [0, 0, 0, 1, 1, 0], picture: Buffer.from('no picture') };
  const { visuals, settled, problems } = stage(async () => parse(makeGlb([square])));
  visuals.add([visual(1), visual(2)]);
  await settled;
  assert.equal(visuals.geometryOf(2)!.getAttribute('paint').getZ(0), -1);
  assert.deepEqual(problems, ['A picture of aaaaaaaaaaaa….glb cannot be drawn: it is no PNG or JPEG file. Its meshes have their base colour.']);
});

test('bodies of the level wait for their meshes, and are drawn by them', async () => {
  const { visuals, settled } = stage(async () => parse(makeGlb([pyramid(2)])));
  const level = new Level({ texture: new THREE.CanvasTexture(null as unknown as HTMLCanvasElement), area: new THREE.Vector4() }, visuals);
  const shapes = new Map<number, Shape>([[1, box], [2, box]]);
  const body = (id: number, shape: number): StaticBody => ({ body: String(id), name: '', shape, trigger: false, position: [0, 5, 0], orientation: UPRIGHT });
  visuals.add([visual(1)]);
  level.add([body(1, 1), body(2, 2)], shapes);
  assert.equal(level.count, 1, 'the other one waits');
  level.settle(await settled, shapes);
  assert.equal(level.count, 2);
  const meshes = level.group.children.slice(1) as THREE.Mesh[];
  assert.deepEqual(meshes.map((mesh) => mesh.geometry.hasAttribute('color')), [false, true]);
  assert.equal(meshes[1]!.geometry.index!.count, 18);
});

test('what comes for a world that is gone is dropped', async () => {
  let give!: (meshes: Meshes) => void;
  const { visuals } = stage(() => new Promise((resolve) => (give = resolve)));
  visuals.add([visual(1)]);
  visuals.clear();
  give(parse(makeGlb([pyramid(1)])));
  await new Promise((resolve) => setImmediate(resolve));
  assert.equal(visuals.geometryOf(1), null);
});

// Packs: bodies that share a draw call, and the detail that each is drawn with.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as THREE from 'three';
import type { Shape } from '../src/protocol/messages.ts';
import { Batches } from '../src/view/batches.ts';
import { DETAILS, detailFor, makeGeometry } from '../src/view/geometry.ts';
import { Pack } from '../src/view/packs.ts';
import { Pictures } from '../src/view/pictures.ts';
import { PlainLight } from '../src/view/plain.ts';
import { Bodies, POSE_PARTS } from '../src/world/bodies.ts';

const BALL = 1;
const CRATE = 2;
const SHAPES = new Map<number, Shape>([
  [BALL, { kind: 'sphere', radius: 0.5 }],
  [CRATE, { kind: 'box', half: [0.5, 0.5, 0.5] }],
]);

function slotsOf(pack: Pack): number[] {
  return [...(pack.places.value.image.data as Uint32Array).subarray(0, pack.count)];
}

test('a pack draws the bodies that it was given, and no other, in few instances', () => {
  const pack = new Pack(new THREE.BoxGeometry(1, 1, 1), () => new THREE.MeshBasicMaterial());
  const places = Array.from({ length: 1000 }, (_, slot) => pack.add(slot));
  assert.equal(pack.mesh.geometry.instanceCount, Math.ceil(1000 / 64));
  const all = pack.places.value.image.data as Uint32Array;
  assert.ok([...all.subarray(1000)].every((slot) => slot === 0xffffffff), 'what is left of a row is nobody');
  assert.equal(pack.remove(places[3]!), 999, 'the last one takes its place');
  assert.equal(slotsOf(pack)[3], 999);
  for (let left = pack.count; left > 0; --left) pack.remove(0);
  assert.equal(pack.mesh.visible, false);
  assert.ok([...all].every((slot) => slot === 0xffffffff));
});

test('a geometry of many vertices is repeated less often, and whole', () => {
  const geometry = new THREE.SphereGeometry(1, 32, 32);
  const pack = new Pack(geometry, () => new THREE.MeshBasicMaterial());
  const vertices = geometry.getAttribute('position').count;
  const copies = pack.mesh.geometry.getAttribute('position').count / vertices;
  assert.equal(copies, Math.floor(4096 / vertices));
  const index = pack.mesh.geometry.index!;
  const body = pack.mesh.geometry.getAttribute('body');
  for (let corner = 0; corner < index.count; ++corner) {
    assert.equal(index.getX(corner) % vertices, geometry.index!.getX(corner % geometry.index!.count));
    assert.equal(body.getX(index.getX(corner)), Math.floor(corner / geometry.index!.count));
  }
});

test('a detail is kept until a body is clearly too large or too small for it', () => {
  assert.equal(DETAILS[detailFor(1, 0)], 'speck');
  assert.equal(DETAILS[detailFor(1000, 4)], 'fine');
  const far = DETAILS.indexOf('far');
  const coarse = DETAILS.indexOf('coarse');
  assert.equal(detailFor(5.2, far), far);
  assert.equal(detailFor(5.2, coarse), coarse);
  assert.equal(detailFor(6, far), coarse);
  assert.equal(detailFor(4, coarse), far);
});

test('whatever its detail a ball covers about as many pixels', () => {
  for (const detail of DETAILS) {
    const geometry = makeGeometry(SHAPES.get(BALL)!, SHAPES, detail);
    const at = (corner: number) => new THREE.Vector3().fromBufferAttribute(geometry.getAttribute('position') as THREE.BufferAttribute, geometry.index!.getX(corner));
    let area = 0;
    for (let corner = 0; corner < geometry.index!.count; corner += 3) area += new THREE.Triangle(at(corner), at(corner + 1), at(corner + 2)).getArea();
    // A convex solid covers a quarter of its surface, in the mean of all sides that it is seen from.
    assert.ok(Math.abs(area / 4 / (Math.PI * 0.25) - 1) < 0.1, `${detail} covers ${(area / 4).toFixed(3)}`);
  }
});

test('bodies move between details as they come nearer, and are all drawn once', () => {
  let batches: Batches;
  const bodies: Bodies = new Bodies({ appeared: (slot) => batches.add(slot), vanished: (slot) => batches.remove(slot), ownerChanged: () => {} });
  batches = new Batches(bodies, SHAPES, { geometryOf: () => null, pictures: new Pictures() }, new PlainLight());
  const appeared = Array.from({ length: 1000 }, (_, low) => ({ high: 0, low: low + 1, shape: low % 2 === 0 ? BALL : CRATE, flags: 0, player: 0, name: '', mass: 1 }));
  bodies.apply({ vanished: [], appeared, owners: [], states: [] });
  const shown = new Float32Array(POSE_PARTS * bodies.capacity);
  for (let slot = 0; slot < 1000; ++slot) shown.set([slot, 0, 0, 0, 0, 0, 0, 1], POSE_PARTS * slot);
  bodies.pose({ shown, moving: 0 });
  const judge = () => {
    for (let left = 4; left > 0; --left) batches.judge(new THREE.Vector3(0, 0, 5), 600);
  };
  const counts = () => [...(batches as unknown as { packs(): Iterable<Pack> }).packs()].filter((pack) => pack.count > 0).map((pack) => pack.count);
  judge();
  assert.equal(batches.drawn, 1000);
  assert.ok(counts().length >= 5, `crates, and balls of at least four details: ${counts().join()}`);
  bodies.apply({ vanished: appeared.slice(0, 500), appeared: [], owners: [], states: [] });
  judge();
  assert.equal(batches.drawn, 500);
  const drawn = [...(batches as unknown as { packs(): Iterable<Pack> }).packs()].flatMap(slotsOf).sort((a, b) => a - b);
  assert.deepEqual(drawn, [...bodies.order.subarray(0, 500)].sort((a, b) => a - b));
});

test('a colour is kept as the screen can show it', () => {
  let batches: Batches;
  const bodies: Bodies = new Bodies({ appeared: (slot) => batches.add(slot), vanished: () => {}, ownerChanged: () => {} });
  batches = new Batches(bodies, SHAPES, { geometryOf: () => null, pictures: new Pictures() }, new PlainLight());
  bodies.apply({ vanished: [], appeared: [{ high: 0, low: 1, shape: BALL, flags: 0, player: 0, name: '', mass: 1 }], owners: [], states: [] });
  batches.setColour(bodies.find('1'), 0.02, 0.4, 1);
  batches.colour(bodies.find('1')).forEach((part, at) => assert.ok(Math.abs(part - [0.02, 0.4, 1][at]!) < 0.005));
});

// The camera, what is clicked through it, and marks that fade.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as THREE from 'three';
import type { Met, Shape } from '../src/protocol/messages.ts';
import { Batches } from '../src/view/batches.ts';
import { CameraRig } from '../src/view/camera_rig.ts';
import { Contacts } from '../src/view/contacts.ts';
import { pick } from '../src/view/picking.ts';
import { Pictures } from '../src/view/pictures.ts';
import { PlainLight } from '../src/view/plain.ts';
import { Bodies, POSE_PARTS } from '../src/world/bodies.ts';

const BOUNDS = [-50, 0, -30, 50, 20, 30];

function makeRig(): CameraRig {
  const rig = new CameraRig(null as unknown as HTMLElement); // nobody drags
  rig.camera.aspect = 16 / 9;
  rig.camera.updateProjectionMatrix();
  return rig;
}

// The furthest of the ground's corners from the middle of the screen, as a share of half the screen.
function furthest(rig: CameraRig): number {
  rig.camera.updateMatrixWorld();
  const corners = [0, 3].flatMap((x) => [2, 5].map((z) => new THREE.Vector3(BOUNDS[x]!, 0, BOUNDS[z]!).project(rig.camera)));
  return Math.max(...corners.flatMap(({ x, y }) => [Math.abs(x), Math.abs(y)]));
}

const rounded = (place: number[]) => place.map((part) => Math.round(1000 * part) / 1000 + 0); // no -0
const near = (found: number, wanted: number, tolerance: number, what: string) => assert.ok(Math.abs(found - wanted) < tolerance, `${what}: ${found}, not ${wanted}`);

test('the overview and the view from above show the whole ground, and are no further away than that takes', () => {
  for (const above of [false, true]) {
    const rig = makeRig();
    rig.frame(BOUNDS, above);
    assert.ok(furthest(rig) < 1, `${furthest(rig)}`);
    assert.ok(furthest(rig) > 0.85, `${furthest(rig)}`);
    assert.equal(rig.pitch < -1.4, above);
  }
});

test('who looks along -z has yaw 0, goes forward that way, and to the right along x', () => {
  const rig = makeRig();
  rig.set([0, 5, 10], [0, 5, 0]);
  near(rig.yaw, 0, 1e-9, 'yaw');
  rig.pan(0, 1, 0.1);
  assert.deepEqual(rounded(rig.target), [0, 5, -0.9]);
  rig.pan(1, 0, 0.1);
  near(rig.target[0]!, 0.9, 1e-6, 'x');
  near(rig.distance, 10, 1e-9, 'the distance stays');
});

test('a stick turns the camera to its side, around what is looked at, and not below the ground', () => {
  const rig = makeRig();
  rig.set([0, 5, 10], [0, 0, 0]);
  const before = rig.distance;
  rig.turn(1, 0, 0.1);
  near(rig.yaw, -0.25, 1e-6, 'to the right');
  for (let left = 20; left > 0; --left) rig.turn(0, 1, 0.1);
  near(rig.distance, before, 1e-6, 'distance');
  assert.ok(rig.camera.position.y > 0, `${rig.camera.position.y}`);
});

test('a body that is followed keeps its place on the screen, and is not jumped to from the side', () => {
  const rig = makeRig();
  rig.set([0, 6, 8], [0, 0, 0]);
  rig.follow(3, 1, 4);
  assert.deepEqual(rounded(rig.target), [3, 1, 4]);
  assert.deepEqual(rounded(rig.camera.position.toArray()), [3, 7, 12]);
  rig.follow(5, 1, 4);
  assert.deepEqual(rounded(rig.camera.position.toArray()), [5, 7, 12]);
  rig.set([0, 300, 400], [0, 0, 0]);
  rig.follow(0, 0, 0);
  assert.ok(rig.distance < 30, `from far away it comes near: ${rig.distance}`);
});

test('a player is chased from behind and above, on the side that the camera was', () => {
  const rig = makeRig();
  rig.set([20, 30, 0], [0, 0, 0]);
  rig.chase(5, 1, 5);
  assert.deepEqual(rounded(rig.target), [5, 1, 5]);
  assert.deepEqual(rounded(rig.camera.position.toArray()), [14, 5.95, 5]);
});

// --- Picking

const BALL = 1;
const SHAPES = new Map<number, Shape>([[BALL, { kind: 'sphere', radius: 0.5 }]]);

// Balls at these places, and what a click along -z from `x`, `y` hits.
function makeBalls(places: number[][], level = new THREE.Group()): (x: number, y: number) => string {
  let batches: Batches;
  const bodies: Bodies = new Bodies({ appeared: (slot) => batches.add(slot), vanished: () => {}, ownerChanged: () => {} });
  batches = new Batches(bodies, SHAPES, { geometryOf: () => null, pictures: new Pictures() }, new PlainLight());
  bodies.apply({ vanished: [], appeared: places.map((_, low) => ({ high: 0, low: low + 1, shape: BALL, flags: 0, player: 0, name: '', mass: 1 })), owners: [], states: [] });
  const shown = new Float32Array(POSE_PARTS * bodies.capacity);
  places.forEach(([x, y, z], low) => shown.set([x!, y!, z!, 0, 0, 0, 0, 1], POSE_PARTS * bodies.find(String(low + 1))));
  bodies.pose({ shown, moving: 0 });
  return (x, y) => {
    const slot = pick(new THREE.Ray(new THREE.Vector3(x, y, 20), new THREE.Vector3(0, 0, -1)), bodies, batches, level);
    return slot < 0 ? '' : bodies.id(slot);
  };
}

test('a click takes the nearest body that it hits', () => {
  const at = makeBalls([[0, 0, -5], [0, 0, 5], [3, 0, 0]]);
  assert.equal(at(0, 0), '2');
  assert.equal(at(3.4, 0), '3');
  assert.equal(at(0, 5), '');
});

test('a click beside a small body takes it, but not instead of one that is hit', () => {
  const at = makeBalls([[0, 0, 0], [0.9, 0, -10]]);
  assert.equal(at(0.7, 0), '2', 'that one is hit, though it is further away');
  assert.equal(at(-0.6, 0), '1', 'beside it');
});

test('a click does not go through a wall', () => {
  const level = new THREE.Group();
  const wall = new THREE.Mesh(new THREE.BoxGeometry(10, 10, 0.2));
  wall.position.set(0, 0, 2);
  wall.updateMatrixWorld();
  level.add(wall);
  const at = makeBalls([[0, 0, 0], [1, 0, 4]], level);
  assert.equal(at(0, 0), '');
  assert.equal(at(1, 0), '2');
});

// --- Marks of contacts

const met = (kind: Met['kind'], point?: number[]): Met => ({ type: 'met', kind, body: '1', other: '2', ...(point ? { point } : {}) });

test('a contact leaves a mark that fades from when it is first drawn', () => {
  const contacts = new Contacts();
  contacts.add(met('contact_began', [1, 2, 3]), null);
  contacts.fade(100);
  assert.deepEqual([contacts.count, contacts.points.visible], [1, true]);
  contacts.fade(100.5);
  assert.equal(contacts.count, 1);
  contacts.fade(100.7);
  assert.deepEqual([contacts.count, contacts.points.visible], [0, false]);
});

test('what ends leaves no mark, nor what is nowhere; a trigger’s is where its body is', () => {
  const contacts = new Contacts();
  contacts.add(met('contact_ended', [1, 2, 3]), [0, 0, 0]);
  contacts.add(met('trigger_left'), [0, 0, 0]);
  contacts.add(met('trigger_entered'), null);
  contacts.fade(1);
  assert.equal(contacts.count, 0);
  contacts.add(met('trigger_entered'), [4, 5, 6]);
  contacts.fade(1);
  assert.deepEqual([...(contacts.points.geometry.getAttribute('position').array as Float32Array).slice(0, 3)], [4, 5, 6]);
});

test('of too many contacts the newest are marked', () => {
  const contacts = new Contacts();
  for (let at = 0; at < 200; ++at) contacts.add(met('contact_began', [at, 0, 0]), null);
  contacts.fade(1);
  assert.equal(contacts.count, 128);
  const places = contacts.points.geometry.getAttribute('position');
  const marked = Array.from({ length: 128 }, (_, at) => places.getX(at)).sort((a, b) => a - b);
  assert.deepEqual([marked[0], marked[127]], [72, 199]);
  contacts.clear();
  assert.equal(contacts.count, 0);
});

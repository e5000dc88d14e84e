import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decode } from '../src/protocol/decode.ts';
import { type FrameToEncode, encodeFrame } from '../src/protocol/encode.ts';
import { type Frame, UNITS_PER_METRE } from '../src/protocol/messages.ts';
import { packOrientation } from '../src/protocol/orientation.ts';
import { borders } from '../src/view/territory.ts';
import { Motion } from '../src/feed/motion.ts';
import { Bodies, POSE_PARTS } from '../src/world/bodies.ts';
import { Playout } from '../src/world/playout.ts';

const STILL = packOrientation([0, 0, 0, 1]);
const MADE = 0x8000_0000_0000_0005n;

function frame(parts: Partial<FrameToEncode>): Frame {
  return decode(encodeFrame({ tick: 1, time: 0, paused: false, vanished: [], appeared: [], changed: [], ...parts })) as Frame;
}

function appear(...ids: bigint[]): Frame {
  return frame({
    appeared: ids.map((id) => ({ id, shape: 1, flags: 0, player: 0, name: `body-${id}`, mass: 1 })),
    changed: ids.map((id) => ({ id, difference: [UNITS_PER_METRE, 0, 0], orientation: STILL, owner: 1, state: 0, speed: 0 })),
  });
}

// The bodies of the worker and of the page, and what the page's listener is told. A frame comes when the bodies have come
// this far on their way.
function make(): { bodies: Bodies; motion: Motion; told: string[]; apply: (frame: Frame, fraction?: number) => void } {
  const motion = new Motion();
  const told: string[] = [];
  const bodies: Bodies = new Bodies({
    appeared: (slot) => told.push(`+${bodies.id(slot)}`),
    vanished: (slot) => told.push(`-${bodies.id(slot)}`),
    ownerChanged: (slot, from) => told.push(`${bodies.id(slot)}: ${from} to ${bodies.owner[slot]}`),
  });
  const apply = (frame: Frame, fraction = 1) => {
    bodies.apply(motion.apply(frame, fraction));
    const same = (of: Bodies) => [...of.order.subarray(0, of.count)].map((slot) => [slot, of.id(slot)]);
    assert.deepEqual(same(bodies), same(motion.bodies), 'both have the same slots');
  };
  return { bodies, motion, told, apply };
}

const x = (motion: Motion, id: bigint, poses = motion.current) => poses[POSE_PARTS * motion.bodies.find(String(id))]!;

test('differences add up, also of ids above 2^53', () => {
  const { motion, apply } = make();
  apply(appear(3n, MADE));
  for (let step = 0; step < 10; ++step) apply(frame({ changed: [{ id: MADE, difference: [UNITS_PER_METRE / 2, 0, 0] }] }));
  assert.equal(x(motion, MADE), 6);
  assert.equal(x(motion, 3n), 1);
});

test('bodies come, go and come again in any order', () => {
  const { bodies, motion, told, apply } = make();
  apply(appear(5n, 1000n));
  apply(appear(1n, 700n));
  apply(frame({ vanished: [5n] }));
  assert.equal(bodies.count, 3);
  assert.equal(bodies.find('5'), -1);
  assert.deepEqual([...bodies.order.subarray(0, 3)].map((slot) => bodies.id(slot)), ['1', '700', '1000']);
  apply(appear(5n));
  assert.equal(x(motion, 5n), 1);
  assert.deepEqual(told.filter((text) => !text.includes(':')), ['+5', '+1000', '+1', '+700', '-5', '+5']);
  bodies.clear();
  assert.equal(bodies.count, 0);
});

test('a change of owner is reported, and counted but for the first', () => {
  const { bodies, told, apply } = make();
  apply(appear(2n));
  apply(frame({ changed: [{ id: 2n, owner: 4 }] }));
  assert.deepEqual(told.slice(-1), ['2: 1 to 4']);
  assert.equal(bodies.owner_changes, 1);
});

test('a change of a body that is not there is refused', () => {
  const { apply } = make();
  apply(appear(2n));
  assert.throws(() => apply(frame({ changed: [{ id: 3n, speed: 1 }] })), /body 3/);
});

test('a body that appears is shown where it is, whatever frames come before a picture', () => {
  const { motion, apply } = make();
  apply(appear(2n));
  apply(frame({ changed: [{ id: 2n, difference: [UNITS_PER_METRE, 0, 0] }] }));
  assert.equal(x(motion, 2n, motion.previous), 1);
  assert.equal(x(motion, 2n, motion.shown), 1);
});

test('a body is shown on its way, and goes on from there when the next frame comes early', () => {
  const { motion, apply } = make();
  apply(appear(2n));
  apply(frame({ changed: [{ id: 2n, difference: [UNITS_PER_METRE, 0, 0] }] }));
  motion.interpolate(0.25);
  assert.equal(x(motion, 2n, motion.shown), 1.25);
  apply(frame({ changed: [{ id: 2n, difference: [UNITS_PER_METRE, 0, 0] }] }), 0.5);
  motion.interpolate(0.5);
  assert.equal(x(motion, 2n, motion.shown), 2.25, 'half way from 1.5 to 3');
});

test('a body that has arrived is no work until it moves again', () => {
  const { motion, apply } = make();
  apply(appear(2n, 3n));
  apply(frame({ changed: [{ id: 2n, difference: [UNITS_PER_METRE, 0, 0] }] }));
  assert.equal(motion.moving_count, 1);
  assert.equal(motion.interpolate(1), true);
  assert.equal(motion.moving_count, 0);
  assert.equal(motion.interpolate(1), false);
  assert.equal(x(motion, 2n, motion.shown), 2);
});

test('a body that vanishes on its way leaves the others on theirs', () => {
  const { motion, apply } = make();
  apply(appear(1n, 2n, 3n));
  apply(frame({ changed: [1n, 2n, 3n].map((id) => ({ id, difference: [UNITS_PER_METRE, 0, 0] as [number, number, number] })) }));
  apply(frame({ vanished: [2n] }), 0.5);
  assert.equal(motion.moving_count, 2);
  motion.interpolate(1);
  assert.deepEqual([1n, 3n].map((id) => x(motion, id, motion.shown)), [2, 2]);
});

test('after a new beginning bodies have the same slots on both sides, whatever each has seen before', () => {
  const { bodies, motion, apply } = make();
  apply(appear(...Array.from({ length: 300 }, (_, at) => BigInt(at + 1))));
  motion.apply(appear(...Array.from({ length: 900 }, (_, at) => BigInt(at + 1000))), 1); // the page hears nothing of this
  bodies.clear();
  motion.clear();
  apply(appear(...Array.from({ length: 400 }, (_, at) => BigInt(at + 1))));
  apply(frame({ vanished: [3n, 7n] }));
  apply(appear(4000n, 5000n, 6000n));
});

test('bodies are found by name: whole, beginning, part', () => {
  const { bodies, apply } = make();
  apply(appear(7n, 12n, 120n));
  assert.equal(bodies.id(bodies.findName('body-12')), '12');
  assert.equal(bodies.id(bodies.findName('Y-7')), '7');
  assert.equal(bodies.findName('nothing'), -1);
});

test('a picture lies between two frames, as far as time has', () => {
  const playout = new Playout();
  for (let count = 0; count < 60; ++count) playout.arrived(count / 20, 100 + count / 20);
  const last_s = 100 + 59 / 20;
  assert.equal(playout.fraction(last_s), 0);
  assert.ok(Math.abs(playout.fraction(last_s + 0.025) - 0.5) < 0.02);
  assert.equal(playout.fraction(last_s + 1), 1);
});

test('borders are the edges that cells of two owners share', () => {
  const cell = (owner: number, min_x: number, max_x: number, min_z = 0, max_z = 1) => ({ owner, min_x, max_x, min_z, max_z });
  const found = borders([cell(1, 0, 1), cell(1, 1, 2), cell(2, 2, 3, 0.5, 2)]);
  assert.deepEqual(found, [{ a: 1, b: 2, x0: 2, z0: 0.5, x1: 2, z1: 1 }]);
});

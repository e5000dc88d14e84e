// Figures and events that the machine room keeps, and how they are written; values of a property, and the colours that
// bodies get.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { RegionStatus, Status } from '../src/protocol/messages.ts';
import { ASLEEP } from '../src/protocol/messages.ts';
import { bytes, capital, clock, number } from '../src/ui/dom.ts';
import { Perf } from '../src/ui/perf.ts';
import { COLOUR_MODES, bodyColour, regionColour, regionCss, textNumber } from '../src/view/colours.ts';
import { gridStep } from '../src/view/territory.ts';
import { Bodies, POSE_PARTS, SPEED } from '../src/world/bodies.ts';
import { KEPT_S, Room } from '../src/world/room.ts';
import { Values } from '../src/world/values.ts';

function region(number: number, alive = true): RegionStatus {
  return { region: number, host: 'h1', standby: 1, alive, tick: 1, tick_rate_hz: 60, step_p50_ms: 1, step_p99_ms: 2, bodies: 3, ghosts: 0, asleep: 0, players: 0, memory_bytes: 1 };
}

function status(...regions: RegionStatus[]): Status {
  return { type: 'status', state: 'RUNNING', reason: '', age_s: 0.5, players: 0, ticks_per_second: 60, regions, changes: [], failovers: 0, lost_bodies: 0, unprotected: [], player_list: [] };
}

test('the room says when a region dies and when it comes back, and not in between', () => {
  const room = new Room();
  assert.equal(room.applyStatus(status(region(1), region(2)), 10), false);
  assert.equal(room.applyStatus(status(region(1), region(2, false)), 11), true);
  assert.deepEqual([...room.dead], [2]);
  assert.equal(room.applyStatus(status(region(1), region(2, false)), 12), false);
  assert.equal(room.applyStatus(status(region(1, false), region(2)), 13), true, 'as many, but another one');
  assert.equal(room.applyStatus(status(region(1), region(2)), 14), true);
  assert.equal(room.dead.size, 0);
});

test('samples are taken at most twice a second, and kept for five minutes', () => {
  const room = new Room();
  for (let at = 0; at <= KEPT_S + 100; at += 0.25) room.applyStatus(status(region(1)), at);
  const times = room.samples.map(({ time_s }) => time_s);
  assert.equal(times[times.length - 1]! - times[0]! <= KEPT_S, true);
  assert.ok(times[times.length - 1]! - times[0]! > KEPT_S - 2, 'and no less');
  for (let at = 1; at < times.length; ++at) assert.ok(times[at]! - times[at - 1]! > 0.5);
});

test('figures grow older from when they were taken, and the newest events are kept', () => {
  const room = new Room();
  assert.equal(room.age_s(5), Infinity);
  room.applyStatus(status(region(1)), 10);
  assert.equal(room.age_s(12), 2.5);
  const event = (at: number) => ({ time: '2026-01-01T00:00:00Z', text: `event ${at}` });
  for (let at = 0; at < 350; at += 50) room.applyEvents(Array.from({ length: 50 }, (_, index) => event(at + index)));
  assert.deepEqual([room.events.length, room.events[0]!.text, room.events[299]!.text], [300, 'event 50', 'event 349']);
  const before = [room.status_version, room.events_version];
  room.clear();
  assert.deepEqual([room.status, room.samples.length, room.events.length, room.age_s(20)], [null, 0, 0, Infinity]);
  assert.deepEqual([room.status_version, room.events_version], before.map((version) => version + 1), 'whoever draws it notices');
});

test('figures are written as people read them', () => {
  assert.deepEqual([number(1234567), number(2, 2), number(2.345, 1)], ['1,234,567', '2.00', '2.3']);
  assert.deepEqual([bytes(0), bytes(61_400), bytes(6_140_000), bytes(61_400_000), bytes(6_140_000_000)], ['0 kB', '61 kB', '6.1 MB', '61 MB', '6.1 GB']);
  assert.deepEqual([clock(0), clock(59.94), clock(61.5), clock(3600), clock(-1)], ['0:00.0', '0:59.9', '1:01.5', '60:00.0', '0:00.0']);
  assert.deepEqual([capital('region 1'), capital('')], ['Region 1', '']);
  assert.deepEqual([gridStep(5), gridStep(200), gridStep(20_000)], [1, 10, 1000]);
});

test('the rate of pictures follows what they take, and the newest are kept', () => {
  const perf = new Perf();
  for (let at = 1; at <= 3500; ++at) perf.add(20 * at, at, 2 * at);
  assert.ok(Math.abs(perf.rate - 50) < 0.1, `${perf.rate}`);
  assert.deepEqual([perf.own_ms.length, perf.own_ms[0], perf.whole_ms[2999]], [3000, 501, 7000]);
  perf.reset();
  assert.equal(perf.own_ms.length + perf.whole_ms.length, 0);
});

test('values have a range of numbers, which is said when it grows', () => {
  const values = new Values();
  values.begin('health');
  assert.equal(values.kind, 'none');
  assert.equal(values.apply({ 1: 50 }), true);
  assert.equal(values.fraction(50), 0.5, 'a range of one value has a middle');
  assert.equal(values.apply({ 2: 100, 3: 0 }), true);
  assert.equal(values.apply({ 1: 75 }), false);
  assert.deepEqual([values.kind, values.get('1'), values.fraction(75), values.fraction('red')], ['number', 75, 0.75, null]);
  values.begin('speed');
  assert.deepEqual([values.get('1'), values.low, values.high], [undefined, Infinity, -Infinity]);
  values.apply({ 1: [3, 4, 0] });
  assert.deepEqual([values.kind, values.high], ['number', 5]);
  values.begin('open');
  values.apply({ 1: false });
  assert.equal(values.kind, 'flag');
  values.begin('team');
  values.apply({ 1: 'red' });
  assert.equal(values.kind, 'text');
});

test('each way of colouring tells apart what it is asked for, and a dead region’s bodies are grey in all', () => {
  const bodies = new Bodies({ appeared: () => {}, vanished: () => {}, ownerChanged: () => {} });
  const appeared = [0, 1].map((low) => ({ high: 0, low, shape: low + 1, flags: 0, player: low, name: '', mass: low === 0 ? 0 : 1000 }));
  bodies.apply({ vanished: [], appeared, owners: [], states: [] });
  const [a, b] = [bodies.find('0'), bodies.find('1')];
  bodies.apply({ vanished: [], appeared: [], owners: [a, 1, b, 2], states: [b, ASLEEP] });
  const shown = new Float32Array(POSE_PARTS * bodies.capacity);
  shown[POSE_PARTS * b + SPEED] = 12;
  bodies.pose({ shown, moving: 0 });
  const values = new Values();
  values.begin('health');
  values.apply({ 0: 0, 1: 100 });
  const colour = (slot: number, mode: (typeof COLOUR_MODES)[number] | 'property', dead = new Set<number>()) => [...bodyColour(bodies, slot, mode, dead, values)];
  for (const mode of [...COLOUR_MODES, 'property'] as const) {
    assert.notDeepEqual(colour(a, mode), colour(b, mode), mode);
    assert.deepEqual(colour(a, mode, new Set([1])), colour(b, mode, new Set([2])), `${mode}, both dead`);
  }
  assert.deepEqual(colour(a, 'region'), regionColour(1));
  assert.deepEqual(colour(b, 'region'), regionColour(2).map((part) => part * 0.62), 'who sleeps is darker');
});

test('regions have colours of their own, however many there are, and texts the same one always', () => {
  const colours = Array.from({ length: 40 }, (_, at) => regionCss(at + 1));
  assert.equal(new Set(colours).size, 40);
  for (const colour of colours) assert.match(colour, /^#[0-9a-f]{6}$/);
  assert.equal(textNumber('red'), textNumber('red'));
  assert.notEqual(textNumber('red'), textNumber('blue'));
});

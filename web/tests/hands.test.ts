// Keys and sticks, and what they become for a player.

import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import { Hands } from '../src/ui/hands.ts';

let pad: { connected: boolean; axes: number[]; buttons: { pressed: boolean }[] } | null = null;
const kinds = ['HTMLInputElement', 'HTMLSelectElement', 'HTMLTextAreaElement', 'HTMLButtonElement'];
Object.assign(globalThis, { window: new EventTarget(), ...Object.fromEntries(kinds.map((kind) => [kind, class extends EventTarget {}])) });
Object.defineProperty(globalThis, 'navigator', { value: { getGamepads: () => [null, pad] }, configurable: true });

const hands = new Hands();

function key(type: 'keydown' | 'keyup', code: string, more: object = {}): Event {
  const event = Object.assign(new Event(type, { cancelable: true }), { code, ctrlKey: false, metaKey: false, altKey: false, ...more });
  window.dispatchEvent(event);
  return event;
}
const hold = (...codes: string[]) => codes.forEach((code) => key('keydown', code));

beforeEach(() => {
  pad = null;
  window.dispatchEvent(new Event('blur'));
});

const rounded = (values: number[]) => values.map((value) => Math.round(100 * value) / 100 + 0); // no -0

test('keys of both hands move, and two at once go no faster than one', () => {
  assert.deepEqual(hands.move, [0, 0]);
  hold('KeyW');
  assert.deepEqual(hands.move, [0, 1]);
  hold('ArrowRight');
  assert.deepEqual(rounded(hands.move), [0.71, 0.71]);
  hold('KeyS', 'KeyA');
  assert.deepEqual(rounded(hands.move), [0, 0], 'opposites rest');
  key('keyup', 'KeyS');
  key('keyup', 'KeyA');
  key('keyup', 'ArrowRight');
  assert.deepEqual(hands.move, [0, 1]);
});

test('a force goes where the camera looks; space lifts, shift doubles, and both are buttons', () => {
  hold('KeyW');
  assert.deepEqual(rounded(hands.steering(0, 0).force), [0, 0, -300]);
  assert.deepEqual(rounded(hands.steering(Math.PI / 2, 0).force), [-300, 0, 0]);
  hold('Space', 'ShiftLeft');
  const { force, move, yaw, pitch, buttons } = hands.steering(Math.PI, -0.5);
  assert.deepEqual([rounded(force), move, yaw, pitch, buttons], [[0, 1200, 600], [0, 1], Math.PI, -0.5, 3]);
});

test('a stick moves beyond its dead zone, adds to the keys, and its buttons jump and run', () => {
  pad = { connected: true, axes: [0.1, 0.1, 0.1, -0.1], buttons: [{ pressed: false }, { pressed: false }] };
  assert.deepEqual([hands.move, rounded(hands.turn)], [[0, 0], [0, 0]]);
  pad.axes = [0.5, -0.5, 1, 0.5];
  assert.deepEqual([hands.move, hands.turn], [[0.5, 0.5], [1, -0.5]]);
  hold('KeyW');
  assert.ok(Math.abs(Math.hypot(...hands.move) - 1) < 1e-9);
  pad.buttons = [{ pressed: true }, { pressed: true }];
  assert.equal(hands.steering(0, 0).buttons, 3);
  pad.connected = false;
  assert.deepEqual(hands.move, [0, 1]);
});

test('a page that loses the focus lets go of all keys', () => {
  hold('KeyW', 'Space');
  window.dispatchEvent(new Event('blur'));
  assert.deepEqual([hands.move, hands.steering(0, 0).buttons], [[0, 0], 0]);
});

test('keys that are the browser’s stay its own, and so do all others', () => {
  assert.equal(key('keydown', 'KeyW', { ctrlKey: true }).defaultPrevented, false);
  assert.equal(key('keydown', 'KeyT').defaultPrevented, false);
  assert.deepEqual(hands.move, [0, 0]);
  assert.equal(key('keydown', 'KeyW').defaultPrevented, true);
});

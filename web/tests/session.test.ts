// A session asks the gateway and takes its answers, here without a browser: the worker is the tests' own.

import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import type { ToPage, ToWorker } from '../src/feed/messages.ts';
import { type Detail, type JsonMessage, Kind, type Welcome } from '../src/protocol/messages.ts';
import { Session, type SessionListener } from '../src/session.ts';

class FakeWorker {
  static last: FakeWorker;
  told: ToWorker[] = [];
  onmessage: ((event: { data: ToPage }) => void) | null = null;
  onerror: (() => void) | null = null;
  constructor() {
    FakeWorker.last = this;
  }
  postMessage(message: ToWorker): void {
    this.told.push(message);
  }
}

const storage = new Map<string, string>();

beforeEach(() => {
  storage.clear();
  Object.assign(globalThis, {
    Worker: FakeWorker,
    sessionStorage: {
      getItem: (key: string) => storage.get(key) ?? null,
      setItem: (key: string, value: string) => storage.set(key, value),
      removeItem: (key: string) => storage.delete(key),
    },
  });
});

const WELCOME: Welcome = { kind: Kind.welcome, instance: 'plaza-1', scene: 'plaza', tick_rate: 60, bounds: [-1, -1, -1, 1, 1, 1], gravity: [0, -9.81, 0], own_body: '0', own_player: 0, properties: [] };

interface Opened {
  session: Session;
  worker: FakeWorker;
  heard: string[]; // calls of the listener
  answers: string[]; // as people are shown
  lacking: { why: string; again: () => void }[];
  say: (message: JsonMessage, link?: number) => void;
  asked: () => Record<string, unknown>[]; // since the last call
}

// A session that is connected, and has its welcome.
function open(): Opened {
  const heard: string[] = [];
  const answers: string[] = [];
  const lacking: { why: string; again: () => void }[] = [];
  const note = (name: string) => () => void heard.push(name);
  const listener: SessionListener = {
    welcomed: note('welcomed'),
    began: note('began'),
    visuals: note('visuals'),
    statics: note('statics'),
    tiled: note('tiled'),
    mapped: note('mapped'),
    framed: note('framed'),
    deadChanged: note('dead'),
    linked: ({ state }) => heard.push(state),
    said: ({ type }) => heard.push(type),
    answered: (text, ok) => answers.push(`${ok ? 'ok' : 'bad'} ${text}`),
    valued: (ids, all) => heard.push(`values of ${ids.join()}${all ? ', of all' : ''}`),
    lacksToken: (why, again) => lacking.push({ why, again }),
    appeared: note('appeared'),
    vanished: note('vanished'),
    ownerChanged: note('owner'),
  };
  const session = new Session(listener);
  const worker = FakeWorker.last;
  session.open('/watch/plaza-1');
  const post = (message: ToPage) => worker.onmessage!({ data: message });
  post({ link: 1, told: 'ready', ready: true });
  post({ link: 1, told: 'state', state: { state: 'open' } });
  post({ link: 1, told: 'message', message: WELCOME });
  let known = 0;
  const asked = () => {
    const fresh = worker.told.slice(known).flatMap((message) => (message.do === 'send' ? [JSON.parse(message.text) as Record<string, unknown>] : []));
    known = worker.told.length;
    return fresh;
  };
  const say = (message: JsonMessage, link = 1) => post({ link, told: 'json', message });
  return { session, worker, heard, answers, lacking, say, asked };
}

test('an order is answered under its own name', () => {
  const { session, answers, say, asked } = open();
  session.order('scale', { regions: 2 });
  session.order('checkpoint');
  assert.deepEqual(asked(), [{ type: 'order', number: 1, order: 'scale', regions: 2 }, { type: 'order', number: 2, order: 'checkpoint' }]);
  say({ type: 'answer', number: 2, ok: true, text: '' });
  say({ type: 'answer', number: 1, ok: false, text: 'regions: 2 is too few' });
  assert.deepEqual(answers, ['ok checkpoint: done', 'bad scale: regions: 2 is too few']);
});

test('an order that nobody answers is reported once, and one without a connection at once', () => {
  const { session, worker, answers } = open();
  session.order('drain', { host: 'h1' });
  const now_s = performance.now() / 1000;
  session.checkOrders(now_s + 14);
  assert.deepEqual(answers, []);
  session.checkOrders(now_s + 16);
  session.checkOrders(now_s + 17);
  assert.deepEqual(answers, ['bad drain: no answer for 15 s']);
  worker.onmessage!({ data: { link: 1, told: 'ready', ready: false } });
  session.order('pause');
  assert.deepEqual(answers.slice(1), ['bad pause: there is no connection to the gateway']);
});

test('an order that lacks a token is given again once one is shown, and the token is kept', () => {
  const { session, answers, lacking, say, asked } = open();
  session.order('pause');
  say({ type: 'answer', number: 1, ok: false, text: 'an order needs a token', needs: 'token' });
  assert.deepEqual([answers, lacking.length, lacking[0]!.why], [[], 1, 'an order needs a token']);
  asked();
  session.authorize({ token: 'tsa_good' }, lacking[0]!.again);
  assert.deepEqual(asked(), [{ type: 'authorize', number: 2, token: 'tsa_good' }]);
  assert.equal(storage.size, 0, 'not before it is known to be good');
  say({ type: 'answer', number: 2, ok: true, text: 'orders are taken' });
  assert.deepEqual(asked(), [{ type: 'order', number: 3, order: 'pause' }]);
  assert.match([...storage.values()].join(), /tsa_good/);
});

test('a token that is worth nothing is not kept, and another one is asked for', () => {
  const { session, lacking, say } = open();
  storage.set('tessera.right', JSON.stringify({ token: 'tsa_old' }));
  session.authorize({ token: 'tsa_bad' }, () => assert.fail('it was refused'));
  say({ type: 'answer', number: 1, ok: false, text: 'that is no token of this cluster', needs: 'token' });
  assert.deepEqual([storage.size, lacking.length], [0, 1]);
});

test('a right that was kept is shown with each new connection', () => {
  const { worker, asked } = open();
  storage.set('tessera.right', JSON.stringify({ key: 'abc' }));
  asked();
  worker.onmessage!({ data: { link: 1, told: 'state', state: { state: 'open' } } });
  assert.deepEqual(asked(), [{ type: 'authorize', number: 1, key: 'abc' }]);
});

test('the gateway is told what is looked at when that is elsewhere, by the distance that it is seen from', () => {
  const { session, worker, asked } = open();
  session.lookAt([1.234567, 0, 0], 100);
  assert.deepEqual(asked(), [{ type: 'view', center: [1.23, 0, 0] }]);
  session.lookAt([5, 0, 0], 100);
  assert.deepEqual(asked(), [], 'a twentieth of the distance is nothing');
  session.lookAt([5, 0, 0], 10);
  assert.equal(asked().length, 1, 'from nearby it is much');
  session.lookAt([6, 0, 0], 1);
  assert.deepEqual(asked(), [], 'less than two metres never are');
  worker.onmessage!({ data: { link: 1, told: 'state', state: { state: 'connecting' } } });
  session.lookAt([500, 0, 0], 10);
  assert.deepEqual(asked(), [], 'nobody listens');
  worker.onmessage!({ data: { link: 1, told: 'state', state: { state: 'open' } } });
  session.lookAt([6, 0, 0], 10);
  assert.equal(asked().length, 1, 'a new connection knows nothing');
});

test('after another welcome the selection and the property are asked for again, and what was known is void', () => {
  const { session, worker, heard, asked } = open();
  session.select('7');
  session.colourBy('health');
  session.colourBy('health');
  assert.deepEqual(asked(), [{ type: 'select', body: '7' }, { type: 'property', name: 'health' }]);
  heard.length = 0;
  worker.onmessage!({ data: { link: 1, told: 'message', message: { ...WELCOME, own_player: 3 } } });
  assert.deepEqual(heard, ['began', 'welcomed']);
  assert.deepEqual(asked(), [{ type: 'select', body: '7' }, { type: 'property', name: 'health' }]);
  assert.deepEqual([session.welcome!.own_player, session.map, session.detail, session.shapes.size], [3, null, null, 0]);
});

test('details and values count only while they are wanted', () => {
  const { session, heard, say } = open();
  const told: Detail = { type: 'detail', body: '7', name: '', owner: 1, epoch: 1, tick: 1, position: [0, 0, 0], linear_velocity: [0, 0, 0], angular_velocity: [0, 0, 0], mass_kg: 1, asleep: false, properties: {} };
  say(told);
  assert.equal(session.detail, null);
  session.select('7');
  say(told);
  assert.equal(session.detail, told);
  session.select('8');
  assert.equal(session.detail, null);
  say({ type: 'values', property: 'health', values: { 7: 80 } });
  session.colourBy('health');
  say({ type: 'values', property: 'health', values: { 7: 80 } });
  assert.deepEqual(heard.filter((text) => text.startsWith('values of')), ['values of 7, of all']);
});

test('what a connection before has sent counts no more', () => {
  const { session, heard, say } = open();
  session.open('/watch/plaza-2');
  heard.length = 0;
  say({ type: 'events', events: [{ time: '2026-01-01T00:00:00Z', text: 'late' }] }, 1);
  assert.deepEqual([heard, session.room.events.length], [[], 0]);
  say({ type: 'events', events: [{ time: '2026-01-01T00:00:00Z', text: 'fresh' }] }, 2);
  assert.equal(session.room.events.length, 1);
});

test('a message that the page cannot take ends the connection, with the reason', () => {
  const { session, worker } = open();
  session.room.applyEvents = () => {
    throw new Error('no such thing');
  };
  worker.onmessage!({ data: { link: 1, told: 'json', message: { type: 'events', events: [] } } });
  const last = worker.told[worker.told.length - 1]!;
  assert.equal(last.do, 'fail');
  assert.match((last as { why: string }).why, /no such thing/);
});

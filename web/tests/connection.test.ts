// The socket to the gateway: how it comes back, and what it says meanwhile. Time and sockets are the tests' own.

import assert from 'node:assert/strict';
import { afterEach, beforeEach, test } from 'node:test';
import { Connection, type LinkState } from '../src/feed/connection.ts';
import { encodeWelcome } from '../src/protocol/encode.ts';
import { PROTOCOL } from '../src/protocol/messages.ts';

const WELCOME = encodeWelcome({ instance: 'plaza-1', scene: 'plaza', tick_rate: 60, bounds: [-1, -1, -1, 1, 1, 1], gravity: [0, -9.81, 0], own_body: '0', own_player: 0, properties: [] });
const BYTES = WELCOME.buffer.slice(WELCOME.byteOffset, WELCOME.byteOffset + WELCOME.byteLength) as ArrayBuffer;

class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = 0;
  binaryType = '';
  sent: string[] = [];
  onopen = () => {};
  onmessage = (_event: { data: ArrayBuffer | string }) => {};
  onclose = (_event: { reason: string }) => {};

  constructor(
    readonly url: string,
    readonly protocol: string,
  ) {
    FakeSocket.all.push(this);
  }
  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.readyState = 3;
  }

  // As the gateway does.
  open(): void {
    this.readyState = FakeSocket.OPEN;
    this.onopen();
  }
  say(data: ArrayBuffer | object): void {
    this.onmessage({ data: data instanceof ArrayBuffer ? data : JSON.stringify(data) });
  }
  end(reason = ''): void {
    this.readyState = 3;
    this.onclose({ reason });
  }
}

let now_s = 0;
let check = () => {};
const kept = { setInterval: globalThis.setInterval, clearInterval: globalThis.clearInterval };

beforeEach(() => {
  now_s = 100;
  FakeSocket.all = [];
  Object.assign(globalThis, {
    WebSocket: FakeSocket,
    location: { protocol: 'http:', host: 'gateway:7710' },
    setInterval: (run: () => void) => ((check = run), 0),
    clearInterval: () => {},
  });
});

afterEach(() => {
  Object.assign(globalThis, kept);
});

interface Watched {
  connection: Connection;
  states: LinkState[];
  heard: string[];
}

function connect(): Watched {
  const states: LinkState[] = [];
  const heard: string[] = [];
  const connection = new Connection(
    '/watch/plaza-1',
    {
      binary: (message) => heard.push(`kind ${message.kind}`),
      json: (message) => heard.push(message.type),
      changed: (state) => states.push(state),
      ready: (ready) => heard.push(ready ? 'ready' : 'not ready'),
    },
    () => now_s,
  );
  return { connection, states, heard };
}

const socket = () => FakeSocket.all[FakeSocket.all.length - 1]!;

// Time passes as the browser's timer lets the page see it.
function pass(seconds: number): void {
  for (let left = Math.round(4 * seconds); left > 0; --left) {
    now_s += 0.25;
    check();
  }
}

// How long it waits before it opens another socket.
function waited(): number {
  const sockets = FakeSocket.all.length;
  const begin = now_s;
  while (FakeSocket.all.length === sockets) {
    pass(0.25);
    assert.ok(now_s - begin < 60, 'it comes back');
  }
  return now_s - begin;
}

test('it opens the world that it is told, and is open with the first message that can be read', () => {
  const { states, heard, connection } = connect();
  assert.deepEqual([socket().url, socket().protocol, socket().binaryType], ['ws://gateway:7710/watch/plaza-1', PROTOCOL, 'arraybuffer']);
  connection.send('too early');
  socket().open();
  assert.deepEqual(states.map(({ state }) => state), ['connecting']);
  socket().say(BYTES);
  connection.send('{}');
  assert.deepEqual([states.map(({ state }) => state), heard, socket().sent], [['connecting', 'open'], ['ready', 'kind 1'], ['{}']]);
});

test('a page that came by HTTPS has its socket encrypted too', () => {
  Object.assign(globalThis, { location: { protocol: 'https:', host: 'worlds.example' } });
  connect();
  assert.equal(socket().url, 'wss://worlds.example/watch/plaza-1');
});

test('it waits longer each time, up to eight seconds, and less again once it was connected', () => {
  const { connection } = connect();
  const waits = Array.from({ length: 6 }, () => (socket().end(), waited()));
  assert.deepEqual(waits, [0.5, 1, 2, 4, 8, 8]);
  socket().open();
  socket().say(BYTES);
  socket().end();
  assert.equal(waited(), 0.5);
  socket().end();
  connection.retryNow();
  assert.equal(connection.state.state, 'connecting', 'somebody did not want to wait');
});

test('a socket that is silent for six seconds is dropped, but not for what the page itself did not read', () => {
  const { states } = connect();
  socket().open();
  socket().say(BYTES);
  pass(5);
  socket().say({ type: 'events', events: [] });
  pass(5);
  now_s += 20; // the page was held up
  check();
  pass(5);
  assert.equal(states[states.length - 1]!.state, 'open');
  pass(1.25);
  const last = states[states.length - 1]!;
  assert.equal(last.state, 'waiting');
  assert.match((last as { why: string }).why, /nothing came/);
});

test('why the gateway hangs up is said, and so is when it is asked again', () => {
  const { states } = connect();
  const last = () => states[states.length - 1] as LinkState & { state: 'waiting' };
  socket().open();
  socket().say({ type: 'problem', code: 'no_world', text: 'instance plaza-1: no such instance', again_s: 2 });
  socket().end('no_world');
  assert.deepEqual([last().code, last().why, last().again_at_s - now_s], ['no_world', 'instance plaza-1: no such instance', 2]);
  assert.equal(waited(), 2);
  socket().end('');
  assert.deepEqual([last().code, last().why], ['lost', 'the connection to the gateway was lost'], 'the reason was that of the socket before');
});

test('where no time helps it stays until somebody asks for another try', () => {
  for (const code of ['ended', 'failed', 'damaged', 'no_recording']) {
    const { connection, states } = connect();
    socket().open();
    socket().say({ type: 'problem', code, text: 'it is so' });
    socket().end(code);
    const sockets = FakeSocket.all.length;
    pass(60);
    assert.equal(FakeSocket.all.length, sockets, code);
    assert.equal((states[states.length - 1] as { again_at_s: number }).again_at_s, Infinity);
    connection.retryNow();
    assert.equal(FakeSocket.all.length, sockets + 1);
  }
});

test('a ticket that is lacking is no reason for a later end', () => {
  const { states } = connect();
  socket().open();
  socket().say({ type: 'problem', code: 'ticket', text: 'a ticket is needed' });
  socket().end();
  assert.equal((states[states.length - 1] as { code: string }).code, 'lost');
});

test('a message that cannot be read begins anew, and what the old socket says then counts no more', () => {
  const { states, heard } = connect();
  const old = socket();
  old.open();
  old.say(BYTES);
  old.say(new Uint8Array([99]).buffer);
  assert.deepEqual(states.map(({ state }) => state), ['connecting', 'open', 'waiting']);
  assert.equal((states[2] as { code: string }).code, 'unreadable');
  assert.equal(old.readyState, 3);
  const before = heard.length;
  old.say(BYTES);
  old.end('late');
  assert.deepEqual([heard.length, states.length], [before, 3]);
  assert.equal(waited(), 0.5);
});

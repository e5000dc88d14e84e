// FakeGateway: serves the page and plays a synthetic world over a real WebSocket, as docs/viewer_protocol.md has it.
//
//   node build/tests/fake_gateway.mjs [--port 7720] [--bodies 2000]

import { createReadStream, existsSync } from 'node:fs';
import { type IncomingMessage, type Server, type ServerResponse, createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { createGzip } from 'node:zlib';
import { type WebSocket, WebSocketServer } from 'ws';
import { encodeMap, encodeShapes, encodeStatics, encodeTiles, encodeVisuals, encodeWelcome } from '../src/protocol/encode.ts';
import { PROTOCOL, type ShapeVisuals } from '../src/protocol/messages.ts';
import { FakeViewer } from './fake_viewer.ts';
import { sha256Of } from './glb_file.ts';
import { FakeWorld, HALF_M, fakeShapes, fakeStatics, largeLevel } from './fake_world.ts';

const INSTANCE = 'plaza-1';
export const ENDED = 'plaza-0'; // was, and is no more
// Recordings that cannot be played.
export const DAMAGED = 'damaged.rec';
export const MISSING = 'missing.rec';
const TYPES: Record<string, string> = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css' };

export interface FakeOptions {
  page: string; // folder of the built page
  bodies: number;
  port?: number;
  frame_ms?: number;
  still?: boolean; // the world does not step by itself
  level?: number; // triangles of a level beyond its own
  token?: string; // orders need it
  ticket?: string; // players need it
  key?: string; // or this
  visuals?: ShapeVisuals[];
  files?: Map<string, Buffer>; // mesh files, by hash
  tiles?: FakeTile[]; // a large level's
}

export interface FakeTile {
  bounds: number[];
  content: Uint8Array;
}

export class FakeGateway {
  readonly tiles_asked: string[] = []; // hashes
  readonly world: FakeWorld;
  served_bytes = 0; // sent of the page, compressed
  refuse = false; // closes viewers at once, as a gateway that goes away
  barred = ''; // why it lets no viewer in, as a gateway whose token has too small a right
  mute = false; // sends no frames, as a gateway whose world sends none
  list_problem = ''; // why the list of worlds is old, as of a gateway whose control plane is away
  no_worlds = false; // the list is empty
  private readonly server: Server;
  private readonly sockets: WebSocketServer;
  readonly refused: string[] = []; // by each socket that asked for a world that is not there
  private readonly viewers = new Set<FakeViewer>();
  private readonly timers: NodeJS.Timeout[] = [];
  private readonly options: FakeOptions;
  private readonly tiles = new Map<string, Uint8Array>(); // by hash

  constructor(options: FakeOptions) {
    this.options = options;
    this.world = new FakeWorld(options.bodies);
    if (options.visuals) this.world.visuals = options.visuals;
    if (options.level) this.world.level = largeLevel(options.level);
    for (const { content } of options.tiles ?? []) this.tiles.set(sha256Of(Buffer.from(content)), content);
    if (options.tiles) {
      this.world.level = [encodeTiles(options.tiles.map(({ bounds, content }) => ({ bounds, bytes: content.length, sha256: sha256Of(Buffer.from(content)) })))];
    }
    this.server = createServer((request, response) => this.serve(request, response));
    this.sockets = new WebSocketServer({ noServer: true, handleProtocols: () => PROTOCOL });
    this.server.on('upgrade', (request, socket, head) => {
      if (this.refuse) socket.destroy();
      else this.sockets.handleUpgrade(request, socket, head, (ws) => this.connected(ws, request.url ?? ''));
    });
  }

  async listen(): Promise<string> {
    await new Promise<void>((done) => this.server.listen(this.options.port ?? 0, '127.0.0.1', done));
    this.timers.push(setInterval(() => this.frame(), this.options.frame_ms ?? 33));
    this.timers.push(setInterval(() => this.status(), 1000));
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}`;
  }

  async close(): Promise<void> {
    for (const timer of this.timers) clearInterval(timer);
    this.dropAll();
    this.server.closeAllConnections();
    await new Promise((done) => this.server.close(done));
  }

  dropAll(): void {
    for (const client of this.sockets.clients) client.terminate();
  }

  // Fields of the status in place of the world's own, from now on.
  report(fields: Record<string, unknown>): void {
    this.world.reported = fields;
    this.status();
  }

  // A status comes when something changes, too.
  kill(region: number): string {
    const problem = this.world.kill(region);
    this.status();
    return problem;
  }

  // Says what is wrong with the world to all who watch, and closes them as a gateway does.
  fail(code: string, text: string): void {
    for (const client of this.sockets.clients) {
      client.send(JSON.stringify({ type: 'problem', code, text }));
      client.close(4000, code);
    }
  }

  // The world has come back: all who watch it begin anew.
  restart(): void {
    for (const viewer of this.viewers) viewer.greet();
  }

  // Bytes that are no message of the protocol.
  garble(bytes: number[]): void {
    for (const client of this.sockets.clients) client.send(Uint8Array.from(bytes));
  }

  // A message of the world, to all who watch.
  say(message: object): void {
    for (const client of this.sockets.clients) client.send(JSON.stringify(message));
  }

  private serve(request: IncomingMessage, response: ServerResponse): void {
    const path = new URL(request.url ?? '/', 'http://x').pathname;
    const json = (value: object) => {
      response.writeHead(200, { 'content-type': 'application/json' });
      response.end(JSON.stringify(value));
    };
    if (path === '/api/worlds') {
      const worlds = this.no_worlds ? [] : [{ instance: INSTANCE, scene: 'plaza', state: 'RUNNING', regions: 4, players: this.world.players.size }];
      return json({ worlds, ...(this.list_problem === '' ? {} : { problem: this.list_problem }) });
    }
    if (path === '/api/recordings') return json({ recordings: [{ file: 'plaza-1-20260101T000000.rec', instance: INSTANCE, bytes: 5400000, seconds: 60 }] });
    if (path.startsWith('/visuals/')) {
      const mesh = this.options.files?.get(path.slice(9, -4));
      response.writeHead(mesh ? 200 : 404, { 'content-type': mesh ? 'model/gltf-binary' : 'text/plain' });
      response.end(mesh ?? `--visuals has no file ${path.slice(9)}\n`);
      return;
    }
    if (path.startsWith('/tiles/')) {
      const tile = this.tiles.get(path.slice(7));
      this.tiles_asked.push(path.slice(7));
      response.writeHead(tile ? 200 : 404, { 'content-type': 'application/octet-stream', 'cache-control': 'private, max-age=31536000, immutable' });
      response.end(tile ?? 'No world that is watched here has such a tile.\n');
      return;
    }
    const file = join(this.options.page, normalize(path === '/' ? '/index.html' : path));
    if (!existsSync(file)) {
      response.writeHead(404);
      response.end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', 'content-encoding': 'gzip' });
    const packed = createReadStream(file).pipe(createGzip({ level: 9 }));
    packed.on('data', (chunk: Buffer) => (this.served_bytes += chunk.length));
    packed.pipe(response);
  }

  private connected(socket: WebSocket, url: string): void {
    if (this.barred !== '') {
      socket.send(JSON.stringify({ type: 'problem', code: 'not_allowed', text: this.barred }));
      return socket.close(4000, 'not_allowed');
    }
    const replay = url.startsWith('/play/');
    const unplayable = { [`/play/${DAMAGED}`]: 'damaged', [`/play/${MISSING}`]: 'no_recording' }[url];
    if (unplayable) {
      socket.send(JSON.stringify({ type: 'problem', code: unplayable, text: `${url.slice(6)}: ${unplayable === 'damaged' ? 'is damaged after 3.5 s' : 'no such recording'}` }));
      return socket.close(4000, unplayable);
    }
    if (!replay && url !== `/watch/${INSTANCE}`) {
      const name = decodeURIComponent(url.replace('/watch/', ''));
      this.refused.push(name);
      if (name === ENDED) {
        socket.send(JSON.stringify({ type: 'problem', code: 'ended', text: `instance ${name} has ended` }));
        return socket.close(4000, 'ended');
      }
      socket.send(JSON.stringify({ type: 'problem', code: 'no_world', text: `instance ${name}: no such instance`, again_s: 2 }));
      return socket.close(4000, 'no_world');
    }
    const viewer = new FakeViewer(this.world, socket, { status: () => this.status(), kill: (region) => this.kill(region), token: this.options.token ?? '', ticket: this.options.ticket ?? '', key: this.options.key ?? '' }, replay);
    this.viewers.add(viewer);
    socket.on('close', () => {
      this.viewers.delete(viewer);
      viewer.left();
    });
    viewer.greet();
    this.status();
  }

  private frame(): void {
    const playing = [...this.viewers].find((viewer) => viewer.replay);
    if (!this.options.still && !this.world.paused && !playing?.replay?.paused) {
      this.world.step();
      this.world.step();
    }
    if (this.mute) return;
    for (const viewer of this.viewers) viewer.frame();
  }

  private status(): void {
    for (const viewer of this.viewers) viewer.status();
  }
}

export function greeting(own_body: string, own_player: number, visuals: ShapeVisuals[]): Uint8Array[] {
  return [
    encodeWelcome({
      instance: INSTANCE,
      scene: 'plaza',
      tick_rate: 60,
      bounds: [-HALF_M, -2, -HALF_M, HALF_M, 40, HALF_M],
      gravity: [0, -9.81, 0],
      own_body,
      own_player,
      properties: [{ name: 'health', type: 1 }],
    }),
    encodeShapes(fakeShapes()),
    ...(visuals.length > 0 ? [encodeVisuals(visuals)] : []),
    encodeStatics(fakeStatics()),
  ];
}

export function mapOf(world: FakeWorld): Uint8Array {
  const side = (low: boolean) => (low ? [-HALF_M, 0] : [0, HALF_M]) as [number, number];
  return encodeMap({
    version: world.map_version,
    regions: world.regions.map(({ region, standby, host }) => ({ region, standby, host })),
    cells: world.regions.map(({ region }) => {
      const [min_x, max_x] = side((region - 1) % 2 === 0);
      const [min_z, max_z] = side(region <= 2);
      return { owner: region, min_x, min_z, max_x, max_z };
    }),
  });
}

if (process.argv[1] && fileURLToPath(import.meta.url) === process.argv[1] && process.argv[1].endsWith('fake_gateway.mjs')) {
  const option = (name: string, otherwise: string) => {
    const at = process.argv.indexOf(name);
    return at < 0 ? otherwise : process.argv[at + 1]!;
  };
  const gateway = new FakeGateway({ page: option('--page', 'dist'), bodies: Number(option('--bodies', '2000')), port: Number(option('--port', '7720')) });
  console.log(`${await gateway.listen()}/#${INSTANCE}`);
}

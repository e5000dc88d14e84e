// FakeViewer: one viewer of the fake gateway: what it has been sent, and what it asks for.

import type { WebSocket } from 'ws';
import { type ChangedBody, encodeFrame } from '../src/protocol/encode.ts';
import { UNITS_PER_METRE } from '../src/protocol/messages.ts';
import { packOrientation } from '../src/protocol/orientation.ts';
import { greeting, mapOf } from './fake_gateway.ts';
import type { FakeBody, FakeWorld } from './fake_world.ts';

const MOST_BUFFERED = 1 << 20;

interface Sent {
  units: number[];
  orientation: number;
  owner: number;
  state: number;
  speed: number;
}

interface Shared {
  status(): void;
  kill(region: number): string;
  token: string; // that orders need; empty: none
  ticket: string; // that players need; empty: none
  key: string;
}

interface Request {
  type: string;
  number?: number;
  order?: string;
  token?: string;
  ticket?: string;
  key?: string;
  body?: string;
  center?: number[];
  name?: string;
  region?: number;
  on?: boolean;
  force?: number[];
  paused?: boolean;
  speed?: number;
  at_s?: number;
  step?: number;
  ticks?: number;
  ticks_per_second?: number;
}

export class FakeViewer {
  replay: { at_s: number; paused: boolean; speed: number } | null;
  private sent = new Map<bigint, Sent>();
  private map_version = 0;
  private events = 0;
  private frames = 0;
  private player = 0;
  private selected = '';
  private recording = false;
  private allowed = false;
  private property = '';
  private red = -1; // the score that it was told

  constructor(
    private readonly world: FakeWorld,
    private readonly socket: WebSocket,
    private readonly shared: Shared,
    replay: boolean,
  ) {
    this.replay = replay ? { at_s: 0, paused: false, speed: 1 } : null;
    socket.on('message', (data) => this.asked(JSON.parse(String(data)) as Request));
  }

  greet(): void {
    this.sent.clear();
    this.map_version = 0;
    const own = this.world.players.get(this.player)?.body.id ?? 0n;
    for (const message of greeting(String(own), this.player, this.world.visuals)) this.socket.send(message);
    for (const message of this.world.level) this.socket.send(message);
  }

  left(): void {
    this.world.leave(this.player);
  }

  // Nothing queues: a viewer that reads slowly gets fewer frames.
  frame(): void {
    if (this.socket.bufferedAmount > MOST_BUFFERED) return;
    if (this.map_version !== this.world.map_version) {
      this.map_version = this.world.map_version;
      this.socket.send(mapOf(this.world));
    }
    if (this.events < this.world.events.length) {
      this.json({ type: 'events', events: this.world.events.slice(this.events) });
      this.events = this.world.events.length;
    }
    this.socket.send(this.makeFrame());
    if (this.selected !== '' && ++this.frames % 3 === 0) this.detail();
    if (this.property !== '') this.values();
    if (this.replay) this.play(1 / 30);
  }

  private makeFrame(): Uint8Array {
    const bodies = [...this.world.bodies].sort((a, b) => (a.id < b.id ? -1 : 1));
    const there = new Set(bodies.map((body) => body.id));
    const vanished = [...this.sent.keys()].filter((id) => !there.has(id)).sort((a, b) => (a < b ? -1 : 1));
    for (const id of vanished) this.sent.delete(id);
    const appeared = bodies
      .filter((body) => !this.sent.has(body.id))
      .map(({ id, shape, player, name, mass }) => ({ id, shape, flags: 0, player, name, mass }));
    const changed: ChangedBody[] = [];
    for (const body of bodies) {
      const change = this.changeOf(body);
      if (change) changed.push(change);
    }
    return encodeFrame({ tick: this.world.tick, time: performance.now() / 1000, paused: this.world.paused, limited: this.world.limited, vanished, appeared, changed });
  }

  private changeOf(body: FakeBody): ChangedBody | null {
    const now: Sent = {
      units: body.position.map((part) => Math.round(part * UNITS_PER_METRE)),
      orientation: packOrientation(body.orientation),
      owner: body.owner,
      state: this.world.stateOf(body),
      speed: Math.round(Math.hypot(...body.velocity) * 64),
    };
    const last = this.sent.get(body.id);
    this.sent.set(body.id, now);
    const change: ChangedBody = { id: body.id };
    const difference = now.units.map((part, axis) => part - (last?.units[axis] ?? 0));
    if (!last || difference.some((part) => part !== 0)) change.difference = difference;
    if (now.orientation !== last?.orientation) change.orientation = now.orientation;
    if (now.owner !== last?.owner) change.owner = now.owner;
    if (now.state !== last?.state) change.state = now.state;
    if (now.speed !== last?.speed) change.speed = now.speed / 64;
    return Object.keys(change).length > 1 ? change : null;
  }

  status(): void {
    const world = this.world;
    const wave = (region: number) => Math.sin(world.tick / 90 + region);
    this.json({
      type: 'status',
      state: 'RUNNING',
      reason: '',
      age_s: 0.3,
      players: world.players.size,
      ticks_per_second: world.paused ? 0 : world.pace,
      regions: world.regions.map((region) => {
        const own = world.bodies.filter((body) => body.owner === region.region);
        return {
          ...region,
          tick: world.tick,
          tick_rate_hz: region.alive ? 60 : 0,
          step_p50_ms: 1.6 + 0.002 * own.length + 0.2 * wave(region.region),
          step_p99_ms: 2.9 + 0.003 * own.length + 0.6 * wave(2 * region.region),
          bodies: own.length,
          ghosts: Math.round(own.length / 14),
          asleep: own.filter((body) => body.asleep).length,
          players: own.filter((body) => body.player > 0).length,
          broadcast_ms: 0.2,
          prediction_ms: 0.1,
          memory_bytes: 61e6 + 9000 * own.length,
        };
      }),
      changes: world.regions.filter((region) => !region.alive).map((region) => `failover of region ${region.region} to region ${region.standby}`),
      failovers: world.failovers,
      lost_bodies: 0,
      unprotected: [],
      player_list: [...world.players].map(([player, { name }]) => ({ player, name, connected: true })),
      ...world.reported,
    });
  }

  private detail(): void {
    const body = this.world.bodies.find((one) => String(one.id) === this.selected);
    if (!body) return this.json({ type: 'detail', body: this.selected, gone: true });
    this.json({
      type: 'detail',
      body: this.selected,
      name: body.name,
      owner: body.owner,
      epoch: 4,
      tick: this.world.tick,
      position: body.position,
      linear_velocity: body.velocity,
      angular_velocity: body.spin,
      mass_kg: body.mass,
      asleep: body.asleep,
      properties: { health: 100 - (this.world.tick % 90), team: 'red' },
    });
  }

  // Once, for none changes here: the last two digits of its id.
  private values(): void {
    const values = Object.fromEntries(this.world.bodies.map(({ id }) => [String(id), Number(id % 100n)]));
    this.json({ type: 'values', property: this.property, values });
    this.property = '';
  }

  private play(step_s: number): void {
    const replay = this.replay!;
    if (!replay.paused) replay.at_s = (replay.at_s + step_s * replay.speed) % 60;
    this.score(Math.floor(replay.at_s / 10));
    this.json({ type: 'play', file: 'plaza-1.rec', begin_s: 0, end_s: 60, ...replay });
  }

  // A goal every ten seconds of the recording.
  private score(red: number): void {
    if (red === this.red) return;
    this.red = red;
    this.json({ type: 'world', properties: { red } });
  }

  private json(message: object): void {
    this.socket.send(JSON.stringify(message));
  }

  private asked(request: Request): void {
    switch (request.type) {
      case 'view':
        this.world.looked_at = request.center ?? [];
        break;
      case 'select':
        this.selected = request.body ?? '';
        break;
      case 'property':
        this.property = request.name ?? '';
        break;
      case 'join':
        if (this.shared.ticket !== '' && request.ticket !== this.shared.ticket) {
          this.json({ type: 'problem', code: 'ticket', text: `instance plaza-1: ticket: ${request.ticket ? 'ran out 31 s ago' : 'this instance takes no guests: a ticket is needed'}` });
          break;
        }
        this.player = this.world.join(request.ticket ? 'ada' : (request.name ?? ''));
        this.greet();
        break;
      case 'leave':
        this.world.leave(this.player);
        this.player = 0;
        this.greet();
        break;
      case 'steer': {
        const player = this.world.players.get(this.player);
        if (player) player.force = request.force ?? [0, 0, 0];
        break;
      }
      case 'order':
        if (this.needs === '' || this.allowed) this.answer(request);
        else this.json({ type: 'answer', number: request.number, ok: false, text: `not_allowed: an order needs a ${this.needs}`, needs: this.needs });
        break;
      case 'authorize':
        this.allowed = this.shared.token !== '' ? request.token === this.shared.token : request.key === this.shared.key;
        this.json({ type: 'answer', number: request.number, ok: this.allowed, text: this.allowed ? 'orders are taken' : `that is no ${this.needs} of this cluster`, ...(this.allowed ? {} : { needs: this.needs }) });
        break;
      case 'play':
        if (this.replay) {
          this.replay.paused = request.paused ?? this.replay.paused;
          this.replay.speed = request.speed ?? this.replay.speed;
          this.replay.at_s = (request.at_s ?? this.replay.at_s) + (request.step ?? 0) / 60;
        }
        break;
      default:
        break;
    }
  }

  private get needs(): string {
    if (this.shared.token !== '') return 'token';
    return this.shared.key !== '' ? 'key' : '';
  }

  private answer(request: Request): void {
    let problem = '';
    this.world.orders.push({ ...request });
    switch (request.order) {
      case 'end_worker':
        problem = this.shared.kill(request.region ?? 0);
        break;
      case 'pause':
      case 'resume':
        this.world.paused = request.order === 'pause';
        break;
      case 'step':
        if (!this.world.paused) problem = 'it is not paused';
        else for (let left = request.ticks ?? 0; left > 0; --left) this.world.step();
        break;
      case 'record':
        this.recording = request.on === true;
        this.json({ type: 'recording', on: this.recording, file: 'plaza-1-20260101T000000.rec', bytes: 1000, problem: '' });
        break;
      case 'pace':
        if ((request.ticks_per_second ?? 0) > 60) problem = `ticks_per_second: ${request.ticks_per_second} is not in 1 to 60`;
        else this.world.pace = request.ticks_per_second ?? 60;
        break;
      case 'checkpoint':
      case 'set_property':
        break;
      default:
        problem = `the fake gateway does not know ${request.order}`;
    }
    this.json({ type: 'answer', number: request.number, ok: problem === '', text: problem });
    this.shared.status();
  }
}

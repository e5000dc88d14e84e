// Session: one world, or one recording, that the page is connected to: what it has been sent, and what it asks for.

import type { LinkState } from './feed/connection.ts';
import { Feed } from './feed/feed.ts';
import type { FrameTold, Poses, Told } from './feed/messages.ts';
import { keepRight, keptRight, type Right } from './right.ts';
import { type Answer, type BinaryMessage, type Detail, type JsonMessage, Kind, type PartitionMap, type Play, type ShapeVisuals, type TileEntry, type Welcome } from './protocol/messages.ts';
import type { ShapeTable } from './view/geometry.ts';
import { Bodies, type BodyListener } from './world/bodies.ts';
import { Room } from './world/room.ts';
import { Values } from './world/values.ts';

const ANSWER_WAIT_S = 15;
// Another place is looked at where it is so far away, as a share of the camera's distance, or as metres.
const LOOKS_ELSEWHERE = 0.05;
const LOOKS_ELSEWHERE_M = 2;

export interface SessionListener extends BodyListener {
  welcomed(welcome: Welcome): void;
  began(): void; // the picture begins anew: what was shown is void
  visuals(visuals: ShapeVisuals[]): void;
  statics(message: BinaryMessage & { kind: Kind.statics }): void;
  tiled(tiles: TileEntry[]): void;
  mapped(map: PartitionMap): void;
  framed(frame: FrameTold): void;
  deadChanged(): void;
  linked(state: LinkState): void;
  said(message: JsonMessage): void;
  answered(text: string, ok: boolean): void;
  valued(ids: string[], all: boolean): void;
  lacksToken(why: string, again: () => void): void; // `again` gives the order once more
}

interface Asked {
  order: string;
  at_s: number;
  again: () => void;
  right?: Right; // that this shows, for `again`
}

export class Session {
  readonly shapes: ShapeTable = new Map();
  readonly bodies: Bodies;
  readonly room = new Room();
  readonly values = new Values();
  welcome: Welcome | null = null;
  map: PartitionMap | null = null;
  detail: Detail | null = null;
  play: Play | null = null;
  tick = 0;
  paused = false;
  frames = 0;
  met = 0; // contacts that have come
  frame_at_s = -Infinity;
  limited_at_s = -Infinity; // when a frame last left bodies out, for want of the budget of bytes
  link: LinkState = { state: 'connecting' };
  selected = '';
  readonly feed: Feed;
  private poses: Poses | null = null; // that bodies are shown with
  private done: Poses[] = []; // that they were shown with since the last picture
  private number = 0;
  private readonly asked = new Map<number, Asked>();
  private looked_at: number[] | null = null; // as this connection was told
  private readonly listener: SessionListener;

  constructor(listener: SessionListener) {
    this.listener = listener;
    this.bodies = new Bodies(listener);
    this.feed = new Feed({
      message: (message, poses) => this.binary(message, poses),
      json: (message) => this.json(message),
      posed: (poses) => this.pose(poses),
      changed: (state) => this.linked(state),
    });
  }

  open(path: string): void {
    this.close();
    this.looked_at = null;
    this.feed.open(path);
  }

  close(): void {
    this.feed.close();
    this.room.clear();
    this.begin();
  }

  retryNow(): void {
    this.feed.retryNow();
  }

  // A picture shows the bodies as they are now; the next is likely at that time.
  drawing(next_s: number): void {
    this.feed.drawing(next_s, this.done);
    this.done = [];
  }

  send(message: object): boolean {
    return this.feed.send(message);
  }

  order(order: string, fields: Record<string, unknown> = {}): void {
    const number = ++this.number;
    if (!this.send({ type: 'order', number, order, ...fields })) {
      this.listener.answered(`${order}: there is no connection to the gateway`, false);
      return;
    }
    this.asked.set(number, { order, at_s: performance.now() / 1000, again: () => this.order(order, fields) });
  }

  // Shows a right, once a connection; then `again`.
  authorize(right: Right, again: () => void): void {
    const number = ++this.number;
    if (!this.send({ type: 'authorize', number, ...right })) {
      this.listener.answered('the right to give orders: there is no connection to the gateway', false);
      return;
    }
    this.asked.set(number, { order: 'the right to give orders', at_s: performance.now() / 1000, again, right });
  }

  // Orders that nobody has answered are reported, once.
  checkOrders(now_s: number): void {
    for (const [number, asked] of this.asked) {
      if (now_s - asked.at_s < ANSWER_WAIT_S) continue;
      this.asked.delete(number);
      this.listener.answered(`${asked.order}: no answer for ${ANSWER_WAIT_S} s`, false);
    }
  }

  // Says what is looked at, from `distance` away: where bytes are scarce, what is near to it comes first.
  lookAt(place: number[], distance: number): void {
    if (this.link.state !== 'open' || this.welcome === null) return;
    const moved = this.looked_at === null ? Infinity : Math.hypot(...place.map((at, axis) => at - this.looked_at![axis]!));
    if (moved < Math.max(LOOKS_ELSEWHERE_M, LOOKS_ELSEWHERE * distance)) return;
    const center = place.map((at) => Math.round(100 * at) / 100);
    if (this.send({ type: 'view', center })) this.looked_at = place;
  }

  select(body: string): void {
    this.selected = body;
    this.detail = null;
    this.send(body === '' ? { type: 'select' } : { type: 'select', body });
  }

  // Has the values of a property sent from now on; an empty name: of none.
  colourBy(property: string): void {
    if (property === this.values.property) return;
    this.values.begin(property);
    this.send(property === '' ? { type: 'property' } : { type: 'property', name: property });
  }

  private begin(): void {
    this.values.clear();
    this.bodies.clear();
    this.shapes.clear();
    this.welcome = this.map = this.detail = null;
    this.listener.began();
  }

  private linked(state: LinkState): void {
    this.link = state;
    if (state.state !== 'open') this.looked_at = null;
    const right = state.state === 'open' ? keptRight() : null;
    if (right) this.authorize(right, () => {});
    this.listener.linked(state);
  }

  private pose(poses: Poses): void {
    this.bodies.pose(poses);
    if (this.poses) this.done.push(this.poses);
    this.poses = poses;
  }

  private binary(message: Told, poses: Poses | null): void {
    switch (message.kind) {
      case Kind.welcome:
        this.begin();
        this.welcome = message;
        this.listener.welcomed(message);
        if (this.selected !== '') this.select(this.selected);
        if (this.values.property !== '') this.send({ type: 'property', name: this.values.property });
        return;
      case Kind.shapes:
        for (const { number, shape } of message.shapes) this.shapes.set(number, shape);
        return;
      case Kind.visuals:
        this.listener.visuals(message.visuals);
        return;
      case Kind.statics:
        this.listener.statics(message);
        return;
      case Kind.tiles:
        this.listener.tiled(message.tiles);
        return;
      case Kind.map:
        this.map = message;
        this.listener.mapped(message);
        return;
      case Kind.frame:
        this.tick = message.tick;
        this.paused = message.paused;
        this.bodies.apply(message);
        if (poses) this.pose(poses);
        this.frame_at_s = performance.now() / 1000;
        if (message.limited) this.limited_at_s = this.frame_at_s;
        ++this.frames;
        this.listener.framed(message);
    }
  }

  private answered({ ok, text, needs }: Answer, asked: Asked | undefined): void {
    if (asked?.right) {
      if (ok) keepRight(asked.right);
      else if (needs) keepRight(null);
      if (ok) return asked.again();
    }
    if (asked && !ok && needs === 'token') return this.listener.lacksToken(text, asked.again);
    this.listener.answered(`${asked?.order ?? 'order'}: ${text === '' ? (ok ? 'done' : 'refused') : text}`, ok);
  }

  private json(message: JsonMessage): void {
    switch (message.type) {
      case 'status':
        if (this.room.applyStatus(message, performance.now() / 1000)) this.listener.deadChanged();
        break;
      case 'events':
        this.room.applyEvents(message.events);
        break;
      case 'detail':
        if (message.body === this.selected) this.detail = message;
        break;
      case 'values':
        if (message.property === this.values.property) this.listener.valued(Object.keys(message.values), this.values.apply(message.values));
        break;
      case 'met':
        ++this.met;
        break;
      case 'play':
        this.play = message;
        break;
      case 'answer': {
        const asked = this.asked.get(message.number);
        this.asked.delete(message.number);
        this.answered(message, asked);
        break;
      }
      default:
        break;
    }
    this.listener.said(message);
  }
}

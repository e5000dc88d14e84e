// Tiles: the parts of a large level about the place that is looked at. They are fetched by their hashes, the nearest
// first, and freed when they are far away, so that a browser holds a bounded part of a level of any size.
//
//   const tiles = new Tiles({ came, gone, problem });
//   tiles.begin(list);                       // the gateway has sent the list
//   tiles.lookAt(target, distance);          // now and then

import { decodeTile } from '../protocol/decode.ts';
import type { TileContent, TileEntry } from '../protocol/messages.ts';

const MOST_BYTES = 96 << 20; // all that is drawn, as it came: some three times as much in memory
const LEAST_REACH_M = 300; // about the place
const REACH_OF_DISTANCE = 6; // and so far, as a share of the camera's distance from it
const KEEP = 1.25; // a tile goes when it is so much further away
const AT_ONCE = 4;
const WAIT_MS = 20_000;
const TRY_AGAIN_MS = 5_000;

export interface TileListener {
  came(tile: number, content: TileContent): void;
  gone(tile: number, content: TileContent): void;
  problem(text: string): void;
}

interface Known extends TileEntry {
  distance: number;
  content: TileContent | null;
  fetching: boolean;
  not_before_ms: number;
}

export class Tiles {
  private known: Known[] = [];
  private world = 0; // counts levels: what comes for one before is void
  private fetching = 0;
  private told = false; // that one could not be had
  private looked_at: { target: number[]; distance: number } | null = null;
  private readonly listener: TileListener;
  private readonly load: (entry: TileEntry) => Promise<TileContent>;

  constructor(listener: TileListener, load = loadTile) {
    this.listener = listener;
    this.load = load;
  }

  get count(): number {
    return this.known.length;
  }

  get drawn(): number {
    return this.known.reduce((sum, tile) => sum + (tile.content ? 1 : 0), 0);
  }

  begin(list: TileEntry[]): void {
    this.clear();
    this.known = list.map((entry) => ({ ...entry, distance: Infinity, content: null, fetching: false, not_before_ms: 0 }));
  }

  // The point that is looked at, and from how far.
  lookAt(target: number[], distance: number): void {
    if (this.known.length === 0) return;
    this.looked_at = { target, distance };
    const reach = Math.max(LEAST_REACH_M, REACH_OF_DISTANCE * distance);
    for (const tile of this.known) tile.distance = distanceTo(tile.bounds, target);
    const nearest = this.known.map((_, at) => at).sort((a, b) => this.known[a]!.distance - this.known[b]!.distance);
    const wanted: number[] = [];
    let bytes = 0;
    for (const at of nearest) {
      const tile = this.known[at]!;
      const near = tile.distance <= (tile.content ? KEEP * reach : reach);
      bytes += near ? tile.bytes : 0;
      if (near && bytes <= MOST_BYTES) wanted.push(at);
      else if (tile.content) this.drop(at);
    }
    for (const at of wanted) {
      const tile = this.known[at]!;
      if (this.fetching >= AT_ONCE) break;
      if (!tile.content && !tile.fetching && tile.not_before_ms <= performance.now()) void this.fetch(at);
    }
  }

  clear(): void {
    ++this.world;
    this.known = [];
    this.fetching = 0;
    this.told = false;
    this.looked_at = null;
  }

  private drop(at: number): void {
    const tile = this.known[at]!;
    this.listener.gone(at, tile.content!);
    tile.content = null;
  }

  private async fetch(at: number): Promise<void> {
    const tile = this.known[at]!;
    const { world } = this;
    tile.fetching = true;
    ++this.fetching;
    let content: TileContent | null = null;
    try {
      content = await this.load(tile);
    } catch (error) {
      if (world !== this.world) return;
      tile.not_before_ms = performance.now() + TRY_AGAIN_MS;
      if (!this.told) this.listener.problem(`A part of the level cannot be had: ${error instanceof Error ? error.message : String(error)}. It is asked for again.`);
      this.told = true;
    }
    if (world !== this.world) return;
    tile.fetching = false;
    --this.fetching;
    if (content) {
      tile.content = content;
      this.listener.came(at, content);
    }
    if (this.looked_at) this.lookAt(this.looked_at.target, this.looked_at.distance);
  }
}

// On the ground.
function distanceTo(bounds: number[], [x, , z]: number[]): number {
  const beyond = (at: number, low: number, high: number) => Math.max(low - at, 0, at - high);
  return Math.hypot(beyond(x!, bounds[0]!, bounds[3]!), beyond(z!, bounds[2]!, bounds[5]!));
}

async function loadTile({ sha256, bytes }: TileEntry): Promise<TileContent> {
  const answer = await fetch(`/tiles/${sha256}`, { signal: AbortSignal.timeout(WAIT_MS) });
  if (!answer.ok) throw new Error((await answer.text()).trim() || `the gateway answers ${answer.status}`);
  const content = await answer.arrayBuffer();
  if (content.byteLength !== bytes) throw new Error(`it has ${content.byteLength} bytes, not ${bytes}`);
  return decodeTile(content);
}

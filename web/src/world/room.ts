// Room: figures and events of a world for the machine room, kept for five minutes.

import type { RegionStatus, Status } from '../protocol/messages.ts';

export const KEPT_S = 300;
const KEPT_EVENTS = 300;

export interface Sample {
  time_s: number;
  regions: Map<number, RegionStatus>;
}

export class Room {
  status: Status | null = null;
  status_at_s = 0;
  samples: Sample[] = [];
  events: { time: string; text: string }[] = [];
  dead = new Set<number>();
  // Counts the changes of what it holds, for those who draw it.
  status_version = 0;
  events_version = 0;

  // Says whether the set of dead regions changed.
  applyStatus(status: Status, now_s: number): boolean {
    this.status = status;
    this.status_at_s = now_s;
    ++this.status_version;
    const last = this.samples[this.samples.length - 1];
    if (!last || now_s - last.time_s > 0.5) {
      this.samples.push({ time_s: now_s, regions: new Map(status.regions.map((region) => [region.region, region])) });
    }
    while (this.samples.length > 0 && now_s - this.samples[0]!.time_s > KEPT_S) this.samples.shift();
    const dead = new Set(status.regions.filter((region) => !region.alive).map((region) => region.region));
    const changed = dead.size !== this.dead.size || [...dead].some((region) => !this.dead.has(region));
    this.dead = dead;
    return changed;
  }

  applyEvents(events: { time: string; text: string }[]): void {
    ++this.events_version;
    this.events.push(...events);
    if (this.events.length > KEPT_EVENTS) this.events.splice(0, this.events.length - KEPT_EVENTS);
  }

  // Seconds since the figures were taken.
  age_s(now_s: number): number {
    return this.status ? this.status.age_s + now_s - this.status_at_s : Infinity;
  }

  clear(): void {
    this.status = null;
    this.samples = [];
    this.events = [];
    this.dead = new Set();
    ++this.status_version;
    ++this.events_version;
  }
}

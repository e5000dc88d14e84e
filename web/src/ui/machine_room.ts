// MachineRoom: the table of regions, charts, what is being changed, and events as they come.

import type { Room } from '../world/room.ts';
import { Charts } from './charts.ts';
import { h, number, setText } from './dom.ts';
import { RegionRow } from './region_row.ts';

export type Order = (order: string, fields?: Record<string, unknown>) => void;

const HEADS: [string, string][] = [
  ['Region', 'number of the region'],
  ['Host', 'where it runs, and the region that stands by'],
  ['Hz', 'ticks a second'],
  ['Step', 'milliseconds of a physics step: median and 99th percentile'],
  ['Send', 'milliseconds of a broadcast of snapshots, and of the prediction in a tick'],
  ['Bodies', 'bodies it owns, and how many of them sleep'],
  ['Ghosts', 'copies of neighbours’ bodies'],
  ['Plr', 'players'],
  ['Mem', 'memory of its process'],
  ['', 'orders'],
];

export class MachineRoom {
  readonly charts = new Charts();
  readonly element: HTMLElement;
  private readonly table = h('tbody');
  private rows = new Map<number, RegionRow>(); // by region
  private readonly changes = h('ul', { class: 'changes', 'aria-live': 'polite' });
  private readonly events = h('ol', { class: 'events', 'aria-live': 'off' });
  private readonly summary = h('p', { class: 'summary' });
  private drawn_status = -1;
  private drawn_events = -1;
  private drawn_changes = '';
  private readonly order: Order;
  private readonly look: (region: number) => void;

  constructor(order: Order, look: (region: number) => void) {
    this.order = order;
    this.look = look;
    const head = h('tr', {}, ...HEADS.map(([text, title]) => h('th', { scope: 'col', title }, text)));
    this.element = h(
      'aside',
      { id: 'room', 'aria-label': 'Machine room' },
      h('section', {}, h('h2', {}, 'Regions'), this.summary, h('table', {}, h('thead', {}, head), this.table), this.changes),
      h('section', { class: 'ordering' }, this.orders()),
      h('section', {}, h('h2', {}, 'Last five minutes'), this.charts.element),
      h('section', { class: 'grows' }, h('h2', {}, 'Events'), this.events),
    );
  }

  // A recording takes no orders.
  setReplay(replay: boolean): void {
    this.element.classList.toggle('replay', replay);
  }

  draw(room: Room, now_s: number): void {
    if (room.status_version !== this.drawn_status) {
      this.drawn_status = room.status_version;
      this.drawStatus(room);
      this.charts.draw(room, now_s);
    }
    if (room.events_version !== this.drawn_events) {
      this.drawn_events = room.events_version;
      this.events.replaceChildren(
        ...[...room.events].reverse().map((event) =>
          h('li', {}, h('time', { datetime: event.time }, event.time.slice(11, 19)), h('span', {}, event.text)),
        ),
      );
    }
  }

  private drawStatus(room: Room): void {
    const status = room.status;
    if (!status) {
      this.rows.clear();
      this.table.replaceChildren();
      setText(this.summary, 'No figures yet.');
      return;
    }
    const bodies = status.regions.reduce((sum, region) => sum + region.bodies, 0);
    const parts = [`${number(bodies)} bodies`, `${status.players} players`, `${number(status.failovers)} failovers`];
    if (status.lost_bodies > 0) parts.push(`${number(status.lost_bodies)} bodies lost`);
    setText(this.summary, parts.join(' · '));
    const unprotected = new Set(status.unprotected);
    this.rows = new Map(status.regions.map(({ region }) => [region, this.rows.get(region) ?? this.rowOf(region)]));
    for (const region of status.regions) this.rows.get(region.region)!.show(region, unprotected.has(region.region));
    stand(this.table, [...this.rows.values()].map(({ element }) => element));
    // Programs that read aloud say a list again when it is written again.
    if (status.changes.join('\n') !== this.drawn_changes) {
      this.drawn_changes = status.changes.join('\n');
      this.changes.replaceChildren(...status.changes.map((text) => h('li', {}, text)));
    }
  }

  private rowOf(region: number): RegionRow {
    return new RegionRow(region, () => this.look(region), () => this.order('end_worker', { region }));
  }

  private orders(): HTMLElement {
    const regions = h('input', { type: 'number', min: 1, max: 64, value: 4, 'aria-label': 'Number of regions' });
    const host = h('input', { type: 'text', placeholder: 'host', size: 6, 'aria-label': 'Host to drain' });
    const button = (text: string, title: string, go: () => void) => h('button', { title, onclick: go }, text);
    return h(
      'div',
      { class: 'orders', role: 'group', 'aria-label': 'Orders' },
      h('span', {}, regions, button('Scale', 'Share the world among so many regions', () => this.order('scale', { regions: Number(regions.value) }))),
      h('span', {}, host, button('Drain', 'Move all regions away from this host', () => this.order('drain', { host: host.value }))),
      button('Checkpoint', 'Store the state of the world', () => this.order('checkpoint')),
      button('Restore', 'Go back to the newest checkpoint', () => this.order('restore', { tick: 0 })),
    );
  }
}

// Puts these into the box, in this order, and moves none that stands where it belongs.
function stand(box: HTMLElement, elements: HTMLElement[]): void {
  const same = box.children.length === elements.length && elements.every((element, at) => box.children[at] === element);
  if (!same) box.replaceChildren(...elements);
}

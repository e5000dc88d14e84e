// MachineRoom: the table of regions, charts, what is being changed, and events as they come.

import type { RegionStatus } from '../protocol/messages.ts';
import { regionCss } from '../view/colours.ts';
import type { Room } from '../world/room.ts';
import { Charts } from './charts.ts';
import { bytes, h, number, setText } from './dom.ts';

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

function ms(value: number | undefined): string {
  return value === undefined ? '–' : number(value, 1);
}

export class MachineRoom {
  readonly charts = new Charts();
  readonly element: HTMLElement;
  private readonly rows = h('tbody');
  private readonly changes = h('ul', { class: 'changes', 'aria-live': 'polite' });
  private readonly events = h('ol', { class: 'events', 'aria-live': 'off' });
  private readonly summary = h('p', { class: 'summary' });
  private drawn_status = -1;
  private drawn_events = -1;
  private readonly order: Order;
  private readonly look: (region: number) => void;

  constructor(order: Order, look: (region: number) => void) {
    this.order = order;
    this.look = look;
    const head = h('tr', {}, ...HEADS.map(([text, title]) => h('th', { scope: 'col', title }, text)));
    this.element = h(
      'aside',
      { id: 'room', 'aria-label': 'Machine room' },
      h('section', {}, h('h2', {}, 'Regions'), this.summary, h('table', {}, h('thead', {}, head), this.rows), this.changes),
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
      this.rows.replaceChildren();
      setText(this.summary, 'No figures yet.');
      return;
    }
    const bodies = status.regions.reduce((sum, region) => sum + region.bodies, 0);
    const parts = [`${number(bodies)} bodies`, `${status.players} players`, `${number(status.failovers)} failovers`];
    if (status.lost_bodies > 0) parts.push(`${number(status.lost_bodies)} bodies lost`);
    setText(this.summary, parts.join(' · '));
    const unprotected = new Set(status.unprotected);
    this.rows.replaceChildren(...status.regions.map((region) => this.row(region, unprotected.has(region.region))));
    this.changes.replaceChildren(...status.changes.map((text) => h('li', {}, text)));
  }

  private row(region: RegionStatus, unprotected: boolean): HTMLElement {
    const name = h(
      'button',
      { class: 'region', title: 'Look at it', onclick: () => this.look(region.region) },
      h('i', { style: `background:${region.alive ? regionCss(region.region) : '#777'}` }),
      String(region.region),
    );
    const standby = region.standby ? `⇢ ${region.standby}` : 'no standby';
    const end = h(
      'button',
      {
        class: 'danger small',
        title: `End the process of region ${region.region} at once, and watch it be replaced`,
        'aria-label': `End worker ${region.region}`,
        onclick: () => this.order('end_worker', { region: region.region }),
      },
      'End',
    );
    const late = region.step_p99_ms * region.tick_rate_hz > 1000;
    return h(
      'tr',
      { class: region.alive ? '' : 'dead' },
      h('td', {}, name),
      h('td', { title: unprotected ? 'its standby does not have its state yet' : '' }, region.host, ' ', h('small', { class: unprotected ? 'warn' : '' }, standby)),
      h('td', {}, region.alive ? number(region.tick_rate_hz) : 'lost'),
      h('td', { class: late ? 'warn' : '' }, number(region.step_p50_ms, 1), ' ', h('small', {}, number(region.step_p99_ms, 1))),
      h('td', {}, ms(region.broadcast_ms), ' ', h('small', {}, ms(region.prediction_ms))),
      h('td', {}, number(region.bodies), ' ', h('small', {}, region.asleep > 0 ? `${number(region.asleep)} z` : '')),
      h('td', {}, number(region.ghosts)),
      h('td', {}, number(region.players)),
      h('td', {}, bytes(region.memory_bytes)),
      h('td', {}, end),
    );
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

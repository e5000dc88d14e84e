// RegionRow: the line of a region in the machine room's table. Its elements stay while its figures change, so the focus
// stays where it is, and a second costs little.

import type { RegionStatus } from '../protocol/messages.ts';
import { regionCss } from '../view/colours.ts';
import { bytes, h, number, setText } from './dom.ts';

// A figure, and a smaller one behind it.
class Figure {
  readonly cell = h('td');
  readonly small = h('small');
  private readonly text = document.createTextNode('');

  constructor() {
    this.cell.append(this.text, ' ', this.small);
  }

  show(text: string, small = ''): void {
    if (this.text.data !== text) this.text.data = text;
    setText(this.small, small);
  }
}

export class RegionRow {
  readonly element: HTMLElement;
  private readonly mark = h('i');
  private readonly host = new Figure();
  private readonly rate = new Figure();
  private readonly step = new Figure();
  private readonly sending = new Figure();
  private readonly bodies = new Figure();
  private readonly ghosts = new Figure();
  private readonly players = new Figure();
  private readonly memory = new Figure();

  constructor(region: number, look: () => void, end: () => void) {
    const name = h('button', { class: 'region', title: 'Look at it', onclick: look }, this.mark, String(region));
    const ending = h(
      'button',
      {
        class: 'danger small',
        title: `End the process of region ${region} at once, and watch it be replaced`,
        'aria-label': `End worker ${region}`,
        onclick: end,
      },
      'End',
    );
    const figures = [this.host, this.rate, this.step, this.sending, this.bodies, this.ghosts, this.players, this.memory];
    this.element = h('tr', {}, h('td', {}, name), ...figures.map(({ cell }) => cell), h('td', {}, ending));
  }

  // `unprotected`: its standby does not have its state yet.
  show(region: RegionStatus, unprotected: boolean): void {
    this.element.classList.toggle('dead', !region.alive);
    this.mark.style.background = region.alive ? regionCss(region.region) : '#777';
    this.host.show(region.host, region.standby ? `⇢ ${region.standby}` : 'no standby');
    this.host.small.classList.toggle('warn', unprotected);
    this.host.cell.title = unprotected ? 'its standby does not have its state yet' : '';
    this.rate.show(region.alive ? number(region.tick_rate_hz) : 'lost');
    this.step.show(number(region.step_p50_ms, 1), number(region.step_p99_ms, 1));
    this.step.cell.classList.toggle('warn', region.step_p99_ms * region.tick_rate_hz > 1000); // longer than a tick
    this.sending.show(ms(region.broadcast_ms), ms(region.prediction_ms));
    this.bodies.show(number(region.bodies), region.asleep > 0 ? `${number(region.asleep)} z` : '');
    this.ghosts.show(number(region.ghosts));
    this.players.show(number(region.players));
    this.memory.show(bytes(region.memory_bytes));
  }
}

function ms(value: number | undefined): string {
  return value === undefined ? '–' : number(value, 1);
}

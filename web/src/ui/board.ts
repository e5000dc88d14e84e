// Board: the properties of the world itself, over the picture: a score, a clock, the phase of a match.

import { h, setText } from './dom.ts';

const DECIMAL = new Intl.NumberFormat('en-US', { maximumFractionDigits: 3 });

export class Board {
  readonly element = h('dl', { id: 'board', hidden: true, 'aria-label': 'Properties of the world' });
  private readonly values = new Map<string, HTMLElement>();
  private names = '';

  clear(): void {
    this.show({});
  }

  show(properties: Record<string, unknown>): void {
    const names = Object.keys(properties);
    if (this.names !== names.join('\n')) this.build(names);
    for (const name of names) setText(this.values.get(name)!, said(name, properties[name]));
  }

  private build(names: string[]): void {
    this.names = names.join('\n');
    this.values.clear();
    this.element.hidden = names.length === 0;
    this.element.replaceChildren(
      ...names.map((name) => {
        const value = h('dd');
        this.values.set(name, value);
        const tile = h('div', {}, h('dt', {}, name.replaceAll('_', ' ')), value);
        const colour = colourIn(name);
        if (colour !== '') tile.style.borderTopColor = colour;
        return tile;
      }),
    );
  }
}

// A name that counts seconds, such as "seconds_left", makes a number a clock.
function said(name: string, value: unknown): string {
  if (typeof value === 'number' && Number.isInteger(value) && name.split('_').includes('seconds')) return minutes(value);
  if (typeof value === 'number') return DECIMAL.format(value);
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (Array.isArray(value)) return value.map((part) => Number(Number(part).toFixed(2))).join(', ');
  return value === '' ? '–' : String(value);
}

function minutes(seconds: number): string {
  const whole = Math.abs(seconds);
  return `${seconds < 0 ? '−' : ''}${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

// A team is often called after its colour: "red", "red_players".
function colourIn(name: string): string {
  const word = name.split('_')[0]!;
  return /^[a-z]+$/.test(word) && CSS.supports('color', word) && !/^(inherit|initial|unset|revert|transparent|currentcolor)$/.test(word) ? word : '';
}

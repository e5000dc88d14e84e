// Tools: how the world is shown, what to look for, and joining it.

import { COLOUR_MODES, type ColourMode, FLAG_COLOURS, regionCss } from '../view/colours.ts';
import type { Values } from '../world/values.ts';
import { h, setText } from './dom.ts';

const PROPERTY = 'property:';

export interface ToolActions {
  mode(mode: ColourMode, property: string): void;
  borders(on: boolean): void;
  contacts(on: boolean): void;
  shadows(on: boolean): void;
  home(): void;
  above(): void;
  find(text: string): boolean;
  join(name: string | null): void;
}

export class Tools {
  readonly element = h('div', { id: 'tools', role: 'toolbar', 'aria-label': 'View' });
  private readonly mode = h(
    'select',
    { 'aria-label': 'Colour bodies by' },
    ...COLOUR_MODES.map((mode) => h('option', { value: mode }, `by ${mode}`)),
  );
  private readonly legend = h('div', { id: 'legend' });
  private readonly search = h('input', { type: 'search', placeholder: 'Find id or name  /', 'aria-label': 'Find a body by id or name' });
  private readonly player = h('input', { placeholder: 'your name', size: 8, maxlength: 32, 'aria-label': 'Your name as a player' });
  private readonly join = h('button', { class: 'primary' }, 'Play');
  private readonly hint = h('small', { hidden: true }, 'WASD or arrows move, Space jumps, Shift runs, drag to look; a gamepad works too');
  private readonly shadows: HTMLButtonElement;
  private readonly hands: HTMLElement;
  private readonly properties = h('optgroup', { label: 'by property' });
  private values: Values | null = null;
  private range = ''; // range of the values, as the legend shows it
  private playing = false;
  private regions: number[] = [];
  private readonly actions: ToolActions;

  constructor(actions: ToolActions) {
    this.actions = actions;
    this.mode.addEventListener('change', () => this.chooseMode());
    this.player.value = stored('name', '');
    const toggle = (text: string, title: string, on: boolean, act: (on: boolean) => void) => {
      const button = h('button', { 'aria-pressed': String(on), title }, text);
      button.addEventListener('click', () => {
        const next = button.getAttribute('aria-pressed') !== 'true';
        button.setAttribute('aria-pressed', String(next));
        act(next);
      });
      return button;
    };
    this.shadows = toggle('Shadows', 'Draw shadows; costs time without a graphics card', false, (on) => this.setShadows(on));
    this.search.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter') return;
      this.search.setAttribute('aria-invalid', String(!actions.find(this.search.value.trim())));
    });
    this.search.addEventListener('input', () => this.search.removeAttribute('aria-invalid'));
    this.hands = h('form', { class: 'hands' }, this.player, this.join, this.hint);
    this.hands.addEventListener('submit', (event) => this.submit(event));
    this.element.append(
      h('div', {}, this.mode, h('button', { title: 'Show all (H)', onclick: () => actions.home() }, 'Overview'), h('button', { title: 'From above (T)', onclick: () => actions.above() }, 'From above')),
      h('div', {}, this.search, toggle('Borders', 'Show borders', true, (on) => actions.borders(on)), toggle('Contacts', 'Mark where players and triggers meet something', true, (on) => actions.contacts(on)), this.shadows),
      this.legend,
      this.hands,
    );
  }

  begin(fast: boolean): void {
    const on = stored('shadows', fast ? 'yes' : 'no') === 'yes';
    this.shadows.setAttribute('aria-pressed', String(on));
    if (on) this.actions.shadows(true);
    this.drawLegend();
  }

  focusFind(): void {
    this.search.focus();
    this.search.select();
  }

  nextMode(): void {
    this.mode.selectedIndex = (this.mode.selectedIndex + 1) % this.mode.options.length;
    this.chooseMode();
  }

  // Properties that the world declares can be chosen, too.
  setProperties(names: string[]): void {
    const options = names.map((name) => h('option', { value: PROPERTY + name }, name));
    const known = [...this.properties.children].map((option) => option.textContent);
    if (known.join() === names.join()) return;
    const lost = !names.includes(this.property) && this.property !== '';
    const kept = this.mode.value;
    this.properties.replaceChildren(...options);
    if (names.length > 0) this.mode.append(this.properties);
    else this.properties.remove();
    this.mode.value = lost ? COLOUR_MODES[0] : kept;
    if (lost) this.chooseMode();
  }

  // Shows the values of the property that bodies are coloured by.
  showValues(values: Values): void {
    const text = `${values.kind} ${values.low} ${values.high}`;
    if (this.property === '' || text === this.range) return;
    this.range = text;
    this.values = values;
    this.drawLegend();
  }

  setRegions(regions: number[]): void {
    this.regions = regions;
    this.drawLegend();
  }

  setPlaying(playing: boolean): void {
    this.playing = playing;
    setText(this.join, playing ? 'Leave' : 'Play');
    this.player.hidden = playing;
    this.hint.hidden = !playing;
  }

  setReplay(replay: boolean): void {
    this.hands.hidden = replay;
  }

  private setShadows(on: boolean): void {
    keep('shadows', on ? 'yes' : 'no');
    this.actions.shadows(on);
  }

  private get property(): string {
    return this.mode.value.startsWith(PROPERTY) ? this.mode.value.slice(PROPERTY.length) : '';
  }

  private get chosen(): ColourMode {
    return this.property === '' ? (this.mode.value as ColourMode) : 'property';
  }

  private chooseMode(): void {
    this.range = '';
    this.values = null;
    this.actions.mode(this.chosen, this.property);
    this.drawLegend();
  }

  private submit(event: Event): void {
    event.preventDefault();
    keep('name', this.player.value);
    this.actions.join(this.playing ? null : this.player.value.trim() || 'visitor');
    this.join.blur();
  }

  private drawLegend(): void {
    const chip = (colour: string, text: string) => h('span', {}, h('i', { style: `background:${colour}` }), text);
    const scale = (low: string, high: string) => [h('span', {}, low), h('b', { class: 'ramp' }), h('span', {}, high)];
    const chips: Record<ColourMode, () => HTMLElement[]> = {
      region: () => this.regions.slice(0, 12).map((region) => chip(regionCss(region), `region ${region}`)),
      speed: () => scale('0', '12 m/s'),
      sleep: () => [chip('#ffb347', 'awake'), chip('#4a5a78', 'asleep')],
      mass: () => scale('light', '10 t'),
      shape: () => [h('span', {}, 'one colour a shape')],
      player: () => [h('span', {}, 'one colour a player')],
      property: () => {
        const values = this.values;
        if (values?.kind === 'number') return scale(short(values.low), short(values.high));
        if (values?.kind === 'flag') return [chip(FLAG_COLOURS.true, 'true'), chip(FLAG_COLOURS.false, 'false')];
        return [h('span', {}, values?.kind === 'text' ? 'one colour a value' : 'no values yet')];
      },
    };
    this.legend.replaceChildren(...chips[this.chosen]());
  }
}

function short(value: number): string {
  return String(Number(value.toPrecision(3)));
}

// A choice stays on this machine; a browser that keeps nothing is fine too.
function stored(key: string, otherwise: string): string {
  try {
    return localStorage.getItem(`tessera.${key}`) ?? otherwise;
  } catch {
    return otherwise;
  }
}

function keep(key: string, value: string): void {
  try {
    localStorage.setItem(`tessera.${key}`, value);
  } catch {
    // Nothing is kept.
  }
}

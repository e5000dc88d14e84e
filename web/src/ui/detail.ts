// DetailPanel: what is known of the body that is selected, and its properties to see and to set.

import { ASLEEP, EXTRAPOLATED, KINEMATIC, PREDICTED, TRIGGER, type Detail } from '../protocol/messages.ts';
import { regionCss } from '../view/colours.ts';
import { type Bodies, POSE_PARTS } from '../world/bodies.ts';
import { h, number } from './dom.ts';
import type { Order } from './machine_room.ts';

export class DetailPanel {
  readonly element = h('section', { id: 'detail', 'aria-label': 'Selected body', hidden: true });
  private readonly title = h('h2');
  private readonly follow = h('button', { 'aria-pressed': 'false', title: 'Follow this body (F)' }, 'Follow');
  private readonly facts = h('dl');
  private readonly properties = h('dl', { class: 'properties' });
  private readonly form: HTMLFormElement;
  private body = '';

  constructor(order: Order, close: () => void, toggleFollow: () => void) {
    const name = h('input', { placeholder: 'property', size: 8, 'aria-label': 'Property to set' });
    const value = h('input', { placeholder: 'value', size: 6, 'aria-label': 'Its value' });
    const set = (event: Event) => {
      event.preventDefault();
      if (name.value !== '') order('set_property', { body: this.body, name: name.value, value: parse(value.value) });
    };
    this.form = h('form', { onsubmit: set }, name, value, h('button', {}, 'Set'));
    this.follow.addEventListener('click', toggleFollow);
    this.element.append(
      h('header', {}, this.title, this.follow, h('button', { 'aria-label': 'Close', title: 'Close (Escape)', onclick: close }, '×')),
      this.facts,
      this.properties,
      this.form,
    );
  }

  show(bodies: Bodies, slot: number, detail: Detail | null, follows: boolean): void {
    this.element.hidden = slot < 0 && !detail?.gone;
    if (this.element.hidden) return;
    this.follow.setAttribute('aria-pressed', String(follows));
    if (slot < 0) {
      this.facts.replaceChildren(h('dd', {}, 'This body is no more.'));
      return;
    }
    this.body = bodies.id(slot);
    const name = bodies.names[slot] || detail?.name || `body ${this.body}`;
    this.title.replaceChildren(h('i', { style: `background:${regionCss(bodies.owner[slot]!)}` }), name);
    const at = POSE_PARTS * slot;
    const facts: [string, string][] = [
      ['id', this.body],
      ['owner', `region ${bodies.owner[slot]}${detail ? `, epoch ${detail.epoch}` : ''}`],
      ['position', vector(detail?.position ?? bodies.shown.subarray(at, at + 3), 2, 'm')],
      ['speed', `${number(bodies.speed(slot), 2)} m/s`],
    ];
    if (detail) {
      facts.push(['velocity', vector(detail.linear_velocity, 2, 'm/s')]);
      facts.push(['rotation', vector(detail.angular_velocity, 2, 'rad/s')]);
    }
    facts.push(['mass', bodies.mass[slot]! > 0 ? `${number(bodies.mass[slot]!, 2)} kg` : 'none'], ['state', state(bodies, slot)]);
    this.facts.replaceChildren(...facts.flatMap(([key, text]) => [h('dt', {}, key), h('dd', {}, text)]));
    const properties = Object.entries(detail?.properties ?? {});
    this.properties.replaceChildren(
      ...properties.flatMap(([key, value]) => [h('dt', {}, key), h('dd', {}, typeof value === 'string' ? value : JSON.stringify(value))]),
    );
    this.properties.hidden = properties.length === 0;
  }
}

function vector(values: ArrayLike<number>, digits: number, unit: string): string {
  return `${Array.from(values, (value) => number(value, digits)).join(', ')} ${unit}`;
}

function state(bodies: Bodies, slot: number): string {
  const bits = bodies.state[slot]!;
  const words = [bits & ASLEEP ? 'asleep' : 'awake'];
  if (bits & EXTRAPOLATED) words.push('extrapolated');
  if (bits & PREDICTED) words.push('predicted');
  if (bodies.flags[slot]! & TRIGGER) words.push('trigger');
  if (bodies.flags[slot]! & KINEMATIC) words.push('kinematic');
  if (bodies.player[slot]! > 0) words.push(`player ${bodies.player[slot]}`);
  return words.join(', ');
}

// A number, true, false or a list where the text is one; otherwise the text itself.
function parse(text: string): unknown {
  try {
    return JSON.parse(text) as unknown;
  } catch {
    return text;
  }
}

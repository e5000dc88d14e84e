// Colours of regions and of bodies. Linear RGB, 0 to 1.

import * as THREE from 'three';
import { ASLEEP } from '../protocol/messages.ts';
import type { Bodies } from '../world/bodies.ts';
import type { Values } from '../world/values.ts';

export const COLOUR_MODES = ['region', 'speed', 'sleep', 'mass', 'shape', 'player'] as const;
export type ColourMode = (typeof COLOUR_MODES)[number] | 'property';
export const FLAG_COLOURS = { false: '#4a5a78', true: '#ffb347' };

const REGION_COLOURS = ['#3d9bff', '#ffb020', '#2fcf8a', '#f2689b', '#9a7bff', '#26c6da', '#ff7043', '#b5d832'];
const GREY = linear('#6b7280');
const FASTEST_MPS = 12;
const SPEED_RAMP = ['#31508f', '#2c9fb3', '#6fd07a', '#f6d743', '#f2553d'].map(linear);

export function regionCss(region: number): string {
  if (region <= 0) return '#8a93a3';
  const index = region - 1;
  if (index < REGION_COLOURS.length) return REGION_COLOURS[index]!;
  return `#${new THREE.Color().setHSL((index * 0.618034) % 1, 0.62, 0.6).getHexString()}`;
}

function linear(css: string): number[] {
  const colour = new THREE.Color(css);
  return [colour.r, colour.g, colour.b];
}

const regions = new Map<number, number[]>();

export function regionColour(region: number): number[] {
  let colour = regions.get(region);
  if (!colour) {
    colour = linear(regionCss(region));
    regions.set(region, colour);
  }
  return colour;
}

function ramp(fraction: number): number[] {
  const at = Math.min(1, Math.max(0, fraction)) * (SPEED_RAMP.length - 1);
  const low = Math.min(SPEED_RAMP.length - 2, Math.floor(at));
  const a = SPEED_RAMP[low]!;
  const b = SPEED_RAMP[low + 1]!;
  return a.map((part, index) => part + (b[index]! - part) * (at - low));
}

const scaled = [0, 0, 0];

// The colour for a value of a property: a ramp for numbers, one colour each for texts; grey where there is none.
function valueColour(value: unknown, values: Values): number[] {
  if (value === undefined || value === null) return GREY;
  if (typeof value === 'boolean') return linear(FLAG_COLOURS[`${value}`]);
  const fraction = values.fraction(value);
  return fraction === null ? regionColour(textNumber(String(value))) : ramp(fraction);
}

// From 1, the same for the same text (FNV-1a).
export function textNumber(text: string): number {
  let hash = 0x811c9dc5;
  for (let at = 0; at < text.length; ++at) hash = Math.imul(hash ^ text.charCodeAt(at), 0x01000193);
  return 1 + ((hash >>> 0) % 1000);
}

export function bodyColour(bodies: Bodies, slot: number, mode: ColourMode, dead: ReadonlySet<number>, values: Values): number[] {
  const owner = bodies.owner[slot]!;
  if (dead.has(owner)) return GREY;
  const asleep = (bodies.state[slot]! & ASLEEP) !== 0;
  switch (mode) {
    case 'region': {
      const colour = regionColour(owner);
      if (!asleep) return colour;
      for (let part = 0; part < 3; ++part) scaled[part] = colour[part]! * 0.62;
      return scaled;
    }
    case 'speed':
      return ramp(Math.sqrt(bodies.speed(slot) / FASTEST_MPS));
    case 'sleep':
      return asleep ? linear('#4a5a78') : linear('#ffb347');
    case 'mass':
      return bodies.mass[slot]! <= 0 ? GREY : ramp(Math.log10(1 + bodies.mass[slot]!) / 4);
    case 'shape':
      return regionColour(bodies.shape[slot]!);
    case 'player':
      return bodies.player[slot]! === 0 ? GREY : regionColour(bodies.player[slot]!);
    case 'property':
      return valueColour(values.get(bodies.id(slot)), values);
  }
}

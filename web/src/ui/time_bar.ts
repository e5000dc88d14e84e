// TimeBar: of a live world the clock, pause and the record button, of a recording play, pause, scrub and step.

import type { Play } from '../protocol/messages.ts';
import { bytes, clock, h, number, setText } from './dom.ts';
import type { Order } from './machine_room.ts';

const CORRECTION_S = 4; // is shown for so long
const PACES = ['0.1', '0.25', '0.5', '1']; // shares of the world's full speed
const SLOWEST = 1; // ticks a second
const PACE_WAIT_S = 2; // so long what was chosen stands, before the world's own word about it counts again

export class TimeBar {
  readonly element = h('footer', { id: 'time', role: 'group', 'aria-label': 'Time' });
  private readonly pause = h('button', { class: 'play', title: 'Pause or go on (P)' }, '❚❚');
  private readonly step = h('button', { title: 'One step forward' }, '▸|');
  private readonly ticks = h('input', { type: 'number', min: 1, max: 36000, value: 1, 'aria-label': 'Ticks a step' });
  private readonly back = h('button', { title: 'One step back' }, '|◂');
  private readonly slider = h('input', { type: 'range', min: 0, max: 1, step: 0.01, 'aria-label': 'Place in the recording' });
  private readonly at = h('output');
  private readonly speed = h(
    'select',
    { 'aria-label': 'Speed' },
    ...['0.25', '0.5', '1', '2', '4'].map((value) => h('option', { value, selected: value === '1' }, `${value}×`)),
  );
  private readonly pace = h(
    'select',
    { 'aria-label': 'Pace', title: 'How fast the world goes, as a share of its full speed' },
    ...PACES.map((value) => h('option', { value, selected: value === '1' }, `${value}×`)),
  );
  private readonly other_pace = h('option'); // that is none of PACES
  private readonly record = h('button', { class: 'record', 'aria-pressed': 'false', title: 'Record this world (R)' }, 'Record');
  private readonly note = h('span', { class: 'note', role: 'status' });
  private readonly correction = h('span', { class: 'note', id: 'correction', title: 'How far the player’s own body was predicted elsewhere than it came to be' });
  private corrected_at_s = -Infinity;
  private paced_at_s = -Infinity;
  private rate = 60; // ticks a second at full speed
  private paused = false;
  private recording = false;
  private replay = false;
  private dragging = false;
  private readonly send: (message: object) => void;
  private readonly order: Order;

  constructor(order: Order, send: (message: object) => void) {
    this.order = order;
    this.send = send;
    this.pause.addEventListener('click', () => this.togglePause());
    this.step.addEventListener('click', () => this.stepBy(1));
    this.back.addEventListener('click', () => this.stepBy(-1));
    this.record.addEventListener('click', () => this.toggleRecord());
    this.speed.addEventListener('change', () => this.send({ type: 'play', speed: Number(this.speed.value) }));
    this.pace.addEventListener('change', () => this.choosePace());
    this.slider.addEventListener('input', () => {
      this.dragging = true;
      this.send({ type: 'play', at_s: Number(this.slider.value) });
    });
    this.slider.addEventListener('change', () => (this.dragging = false));
    this.element.append(this.pause, this.back, this.step, this.ticks, this.slider, this.at, this.speed, this.pace, this.record, this.note, this.correction);
    this.setReplay(false);
  }

  setReplay(replay: boolean): void {
    this.replay = replay;
    for (const element of [this.back, this.slider, this.speed]) element.hidden = !replay;
    this.record.hidden = this.pace.hidden = replay;
    this.showPaused(false);
    setText(this.note, '');
    setText(this.correction, '');
  }

  togglePause(): void {
    if (this.replay) this.send({ type: 'play', paused: !this.paused });
    else this.order(this.paused ? 'resume' : 'pause');
  }

  toggleRecord(): void {
    if (!this.replay) this.order('record', { on: !this.recording });
  }

  // A recording goes by one tick, a paused world by as many as are asked for.
  stepBy(steps: number): void {
    if (this.replay) this.send({ type: 'play', paused: true, step: steps });
    else if (steps > 0 && this.paused && this.ticks.reportValidity()) this.order('step', { ticks: Number(this.ticks.value) });
  }

  showCorrection(text: string): void {
    this.corrected_at_s = performance.now() / 1000;
    setText(this.correction, `prediction corrected by ${text}`);
    window.setTimeout(() => {
      if (performance.now() / 1000 - this.corrected_at_s >= CORRECTION_S) setText(this.correction, '');
    }, 1000 * CORRECTION_S + 50);
  }

  showPaused(paused: boolean): void {
    this.paused = paused;
    this.step.hidden = !this.replay && !paused;
    this.ticks.hidden = this.replay || !paused;
    setText(this.pause, paused ? '▶' : '❚❚');
    this.pause.setAttribute('aria-label', paused ? 'Go on' : 'Pause');
  }

  showTick(tick: number, rate: number): void {
    if (!this.replay) setText(this.at, `tick ${number(tick)} · ${clock(tick / rate)}`);
  }

  // `ticks_per_second` that the world makes; 0: it is paused, and says nothing of its pace.
  showPace(ticks_per_second: number, rate: number, now_s: number): void {
    this.rate = rate;
    if (ticks_per_second === 0 || now_s - this.paced_at_s < PACE_WAIT_S) return;
    const share = String(Math.round((1000 * ticks_per_second) / rate) / 1000);
    if (this.pace.value === share) return;
    if (PACES.includes(share)) {
      this.other_pace.remove();
    } else {
      this.other_pace.value = share;
      setText(this.other_pace, `${share}×`);
      this.pace.append(this.other_pace);
    }
    this.pace.value = share;
  }

  private choosePace(): void {
    this.paced_at_s = performance.now() / 1000;
    this.order('pace', { ticks_per_second: Math.max(SLOWEST, Number(this.pace.value) * this.rate) });
  }

  showPlay(play: Play): void {
    this.showPaused(play.paused);
    this.slider.min = String(play.begin_s);
    this.slider.max = String(play.end_s);
    if (!this.dragging) this.slider.value = String(play.at_s);
    this.speed.value = String(play.speed);
    setText(this.at, `${clock(play.at_s - play.begin_s)} of ${clock(play.end_s - play.begin_s)}`);
  }

  showRecording(message: { on: boolean; file: string; bytes: number; problem: string }): void {
    this.recording = message.on;
    this.record.setAttribute('aria-pressed', String(message.on));
    setText(this.record, message.on ? 'Stop recording' : 'Record');
    const done = message.file !== '' && !message.on;
    const what = message.file === '' ? '' : `${message.file}, ${bytes(message.bytes)}`;
    const link = h('a', { href: `#play/${message.file}` }, what);
    this.note.replaceChildren(...(message.problem === '' ? [] : [`${message.problem} `]), done ? link : what);
  }
}

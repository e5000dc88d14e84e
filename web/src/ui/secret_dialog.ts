// SecretDialog: asks for something that only this visitor has: an access token, or a ticket.
//
//   const ask = new SecretDialog({ id: 'ticket', title: 'Who plays?', label: 'Ticket', note: '...', use: 'Play' });
//   ask.ask('A ticket is needed', (ticket) => ...);

import { h, setText } from './dom.ts';

export interface SecretTexts {
  id: string; // the element’s
  title: string;
  label: string; // the field’s
  note: string; // where it goes, and how long it is kept
  warning: string; // for a page that came without encryption
  use: string; // the button's
}

export class SecretDialog {
  readonly element: HTMLDialogElement;
  private readonly why = h('p');
  private readonly field: HTMLInputElement;
  private give: (secret: string) => void = () => {};

  constructor(texts: SecretTexts) {
    const open = location.protocol === 'https:' || /^(localhost|127\.[0-9.]+|\[::1\])$/.test(location.hostname);
    this.field = h('input', { type: 'password', autocomplete: 'off', spellcheck: 'false', required: true, 'aria-label': texts.label });
    const form = h(
      'form',
      {},
      h('h2', {}, texts.title),
      this.why,
      this.field,
      h('p', {}, texts.note),
      h('p', { class: 'warn', hidden: open }, texts.warning),
      h('div', {}, h('button', { type: 'button', onclick: () => this.forget() }, 'Cancel'), h('button', { class: 'primary' }, texts.use)),
    );
    this.element = h('dialog', { id: texts.id, class: 'secret', 'aria-label': texts.label }, form);
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      const secret = this.field.value.trim();
      this.forget();
      this.give(secret);
    });
    // Not at `close`: that comes later, perhaps when the dialog asks again.
    this.element.addEventListener('cancel', () => (this.field.value = ''));
  }

  ask(why: string, give: (secret: string) => void): void {
    this.give = give;
    setText(this.why, why);
    if (!this.element.open) this.element.showModal();
    this.field.focus();
  }

  private forget(): void {
    this.field.value = '';
    this.element.close();
  }
}

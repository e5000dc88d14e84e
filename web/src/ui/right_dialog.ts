// RightDialog: asks for an access token when an order needs one.

import { h, setText } from './dom.ts';

export class RightDialog {
  readonly element = h('dialog', { id: 'right', 'aria-label': 'Access token' });
  private readonly why = h('p');
  private readonly token = h('input', { type: 'password', autocomplete: 'off', spellcheck: 'false', required: true, 'aria-label': 'Access token' });
  private give: (token: string) => void = () => {};

  constructor() {
    const open = location.protocol === 'https:' || /^(localhost|127\.[0-9.]+|\[::1\])$/.test(location.hostname);
    const form = h(
      'form',
      {},
      h('h2', {}, 'Who gives this order?'),
      this.why,
      this.token,
      h('p', {}, 'The token is kept until this tab is closed, and sent to this gateway alone.'),
      h('p', { class: 'warn', hidden: open }, 'This page came without encryption: whoever is on the network between can read the token.'),
      h('div', {}, h('button', { type: 'button', onclick: () => this.forget() }, 'Cancel'), h('button', { class: 'primary' }, 'Use token')),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      const token = this.token.value.trim();
      this.forget();
      this.give(token);
    });
    // Not at `close`: that comes later, perhaps when the dialog asks again.
    this.element.addEventListener('cancel', () => (this.token.value = ''));
    this.element.append(form);
  }

  ask(why: string, give: (token: string) => void): void {
    this.give = give;
    setText(this.why, why);
    if (!this.element.open) this.element.showModal();
    this.token.focus();
  }

  private forget(): void {
    this.token.value = '';
    this.element.close();
  }
}

// Right: what this visitor shows to give orders: the key in the address that a local cluster printed, or an access token
// that was typed. It is kept while the tab lives, and goes to the gateway alone. A ticket, which says who plays, is good
// for one try and kept nowhere.

export type Right = { key: string } | { token: string };

const KEPT = 'tessera.right';

// The key of an address `#key=...` or `#key=...&plaza-1` is kept, and taken out of the address, which people copy.
export function takeKey(): void {
  const found = /^#key=([0-9a-f]+)(?:&(.*))?$/.exec(location.hash);
  if (!found) return;
  keepRight({ key: found[1]! });
  history.replaceState(null, '', `#${found[2] ?? ''}`);
}

// The ticket of an address `#ticket=...` or `#ticket=...&plaza-1`, taken out of the address; empty: there is none. What
// follows the hash a browser sends to no server.
export function takeTicket(): string {
  const found = /^#ticket=([A-Za-z0-9_-]+)(?:&(.*))?$/.exec(location.hash);
  if (!found) return '';
  history.replaceState(null, '', `#${found[2] ?? ''}`);
  return found[1]!;
}

export function keptRight(): Right | null {
  try {
    return JSON.parse(sessionStorage.getItem(KEPT) ?? 'null') as Right | null;
  } catch {
    return null;
  }
}

export function keepRight(right: Right | null): void {
  try {
    if (right) sessionStorage.setItem(KEPT, JSON.stringify(right));
    else sessionStorage.removeItem(KEPT);
  } catch {
    // A browser that keeps nothing asks again.
  }
}

/** Choices of a person that this browser keeps; it may forbid to store anything. */

export function recall(name: string): string | null {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

export function remember(name: string, text: string): void {
  try {
    localStorage.setItem(name, text);
  } catch {
    // It is as it always was the next time.
  }
}

/** Returns whether a switch was left on. */
export function wasOn(name: string): boolean {
  return recall(name) !== "false";
}

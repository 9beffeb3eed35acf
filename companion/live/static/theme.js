// Light or dark: the system's wish, unless the button was pressed.

const KEY = "companion-theme";
const dark = matchMedia("(prefers-color-scheme: dark)");
const still = matchMedia("(prefers-reduced-motion: reduce)");

/** A colour of the style sheet by its name, without the dashes. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** The person wants nothing to move that need not. */
export function reducedMotion() {
  return still.matches;
}

/** Let the button switch, and tell `changed` whenever the colours are others. */
export function startTheme(button, changed) {
  const root = document.documentElement;
  const kept = remembered();
  if (kept) root.dataset.theme = kept;
  button.addEventListener("click", () => {
    const now = root.dataset.theme ?? (dark.matches ? "dark" : "light");
    root.dataset.theme = now === "dark" ? "light" : "dark";
    remember(root.dataset.theme);
    changed();
  });
  dark.addEventListener("change", changed);
}

function remembered() {
  try {
    const value = localStorage.getItem(KEY);
    return value === "dark" || value === "light" ? value : null;
  } catch {
    return null; // storage is switched off: the system's wish holds
  }
}

function remember(value) {
  try {
    localStorage.setItem(KEY, value);
  } catch {
    // It holds until the page is closed.
  }
}

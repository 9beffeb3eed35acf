// Land and abort: a button, a question, a request with the token, its answer.

const KEY = "companion-token";
const WAYS = {
  land: {
    title: "Land now?",
    text: "The vehicle stops following its path and lands where it is.",
    yes: "Land",
  },
  abort: {
    title: "Abort the flight?",
    text:
      "The companion stops commanding at once, wherever the vehicle is, and the autopilot's " +
      "failsafe takes over.",
    yes: "Abort",
  },
};

/** The token: from the address once, then from this tab's memory; the address loses it. */
export function takeToken() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found) {
    history.replaceState(null, "", location.pathname + location.search);
    try {
      sessionStorage.setItem(KEY, found);
    } catch {
      // It holds until the page is loaded again.
    }
    return found;
  }
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return null;
  }
}

export class Commands {
  constructor(token) {
    this.token = token;
    this.group = document.getElementById("pilot");
    this.answer = document.getElementById("answer");
    this.dialog = document.getElementById("confirm");
    this.yes = document.getElementById("confirm-yes");
    this.asked = null;
    for (const name of Object.keys(WAYS)) {
      document.getElementById(name).addEventListener("click", () => this.#ask(name));
    }
    document.getElementById("confirm-no").addEventListener("click", () => this.dialog.close());
    this.yes.addEventListener("click", () => {
      this.dialog.close();
      this.#send(this.asked);
    });
  }

  /** Are the buttons there? Only while the flight takes commands and this tab has the token. */
  offer(possible) {
    const shown = Boolean(possible && this.token);
    this.group.hidden = !shown;
    document.body.classList.toggle("commanding", shown);
    if (!shown && this.dialog.open) this.dialog.close();
  }

  #ask(name) {
    const way = WAYS[name];
    this.asked = name;
    document.getElementById("confirm-title").textContent = way.title;
    document.getElementById("confirm-text").textContent = way.text;
    this.yes.textContent = way.yes;
    this.yes.className = name;
    this.dialog.showModal();
    document.getElementById("confirm-no").focus();
  }

  async #send(name) {
    this.#say("none", `${name}: asked …`);
    try {
      const reply = await fetch("/api/command", {
        method: "POST",
        headers: { "Content-Type": "application/json", "X-Companion-Token": this.token },
        body: JSON.stringify({ command: name }),
      });
      const said = await reply.json().catch(() => ({}));
      if (reply.ok) this.#say("good", said.answer ?? `${name}: taken`);
      else this.#say("bad", `${name}: ${said.error ?? said.detail ?? `refused (${reply.status})`}`);
    } catch {
      this.#say("bad", `${name}: not sent, the page's server does not answer`);
    }
  }

  #say(level, text) {
    this.answer.dataset.level = level;
    this.answer.textContent = text;
  }
}

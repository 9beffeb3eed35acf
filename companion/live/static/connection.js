// The way to the page's server: flight and history by GET, then frames by WebSocket, and again
// after each loss, ever more slowly.

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 10000;

export class Connection {
  /** `on` has the functions history(frames, messages), flight, frame, message, end, state. */
  constructor(on) {
    this.on = on;
    this.waitMs = FIRST_WAIT_MS;
    this.over = false;
  }

  async start() {
    try {
      const flight = await get("/api/flight");
      this.on.flight(flight);
      if (flight.mode === "recorded") {
        const history = await get("/api/history");
        this.on.history(history.frames, history.messages);
        this.over = true;
      } else {
        this.#open();
      }
    } catch {
      this.#again();
    }
  }

  // What comes before the history is there waits for it: nothing is lost, nothing is twice.
  #open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws`);
    let waiting = [];
    socket.addEventListener("open", async () => {
      try {
        const history = await get("/api/history");
        this.on.history(history.frames, history.messages);
        const newest = history.messages.at(-1)?.t ?? -Infinity;
        for (const item of waiting) {
          if (item.type !== "message" || item.t > newest) this.#take(item);
        }
        waiting = null;
        this.waitMs = FIRST_WAIT_MS;
        this.on.state("open");
      } catch {
        socket.close();
      }
    });
    socket.addEventListener("message", (event) => {
      const item = JSON.parse(event.data);
      if (waiting) waiting.push(item);
      else this.#take(item);
    });
    socket.addEventListener("close", () => {
      if (!this.over) this.#again();
    });
  }

  #take(item) {
    if (item.type === "end") this.over = true;
    this.on[item.type]?.(item);
  }

  #again() {
    this.on.state("lost", this.waitMs / 1000);
    setTimeout(() => this.start(), this.waitMs);
    this.waitMs = Math.min(LONGEST_WAIT_MS, this.waitMs * 2);
  }
}

async function get(path) {
  const answer = await fetch(path, { cache: "no-store" });
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

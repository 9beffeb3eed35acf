// The list of messages: those up to the time shown, the newest last and in view.

import { clock } from "./format.js";

const MOST = 500;

export class Messages {
  constructor(list) {
    this.list = list;
    this.shown = [];
  }

  /** Show the messages of a flight up to a time. */
  show(messages, time) {
    let count = messages.length;
    while (count > 0 && messages[count - 1].t > time + 1e-9) count -= 1;
    const wanted = messages.slice(Math.max(0, count - MOST), count);
    if (wanted.length === this.shown.length && wanted.at(-1) === this.shown.at(-1)) return;
    // Only what is new is added, so that a screen reader reads that alone.
    const grown = this.shown.every((message, i) => message === wanted[i]);
    if (grown) this.list.append(...wanted.slice(this.shown.length).map(entry));
    else this.list.replaceChildren(...wanted.map(entry));
    this.shown = wanted;
    this.list.scrollTop = this.list.scrollHeight;
  }
}

function entry(message) {
  const item = document.createElement("li");
  item.dataset.severity = message.severity;
  const time = document.createElement("time");
  time.textContent = clock(message.t);
  const text = document.createElement("span");
  text.textContent = message.severity === "info" ? message.text : `${message.severity}: ${message.text}`;
  item.append(time, text);
  return item;
}

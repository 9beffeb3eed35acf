// Plays a flight that is over: pause, speed, and a slider that works by keyboard.

import { clock } from "./format.js";

const STEP_S = 0.5;
const LEAP_S = 5;
const PLAY = "M6 4l10 6-10 6z";
const PAUSE = "M5 4h3.5v12H5zM11.5 4H15v12h-3.5z";

export class Player {
  /** `moved(time)` is called whenever another time is shown. */
  constructor(moved) {
    this.moved = moved;
    this.bar = document.getElementById("player");
    this.button = document.getElementById("play");
    this.slider = document.getElementById("slider");
    this.clock = document.getElementById("clock");
    this.speed = document.getElementById("speed");
    this.time = 0;
    this.range = [0, 1];
    this.playing = false;
    this.drawnAt = 0;
    this.#icon();
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.seek(this.range[0] + Number(this.slider.value)));
    this.slider.addEventListener("keydown", (event) => this.#key(event));
  }

  get active() {
    return !this.bar.hidden;
  }

  /** Offer the times from `begin` to `end`, and show `time`. */
  offer(begin, end, time) {
    this.range = [begin, Math.max(end, begin)];
    this.slider.max = this.range[1] - begin;
    this.bar.hidden = false;
    document.body.classList.add("playing");
    this.seek(time);
  }

  withdraw() {
    this.bar.hidden = true;
    this.playing = false;
    document.body.classList.remove("playing");
  }

  seek(time) {
    const [begin, end] = this.range;
    this.time = Math.min(end, Math.max(begin, time));
    this.slider.value = this.time - begin;
    const said = `${clock(this.time)} of ${clock(end)}`;
    this.slider.setAttribute("aria-valuetext", said);
    this.clock.textContent = said.replace(" of ", " / ");
    this.moved(this.time);
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.time >= this.range[1] - 1e-6) this.seek(this.range[0]);
    this.#icon();
    if (!this.playing) return;
    this.drawnAt = performance.now();
    requestAnimationFrame((now) => this.#step(now));
  }

  #step(now) {
    if (!this.playing) return;
    const passed = Math.max(0, now - this.drawnAt) / 1000;
    this.drawnAt = now;
    this.seek(this.time + passed * Number(this.speed.value));
    if (this.time >= this.range[1]) {
      this.playing = false;
      this.#icon();
    } else {
      requestAnimationFrame((next) => this.#step(next));
    }
  }

  #key(event) {
    const back = ["ArrowLeft", "ArrowDown"].includes(event.key);
    const forth = ["ArrowRight", "ArrowUp"].includes(event.key);
    const leap = { PageDown: -LEAP_S, PageUp: LEAP_S }[event.key];
    if (back || forth) this.seek(this.time + (forth ? 1 : -1) * (event.shiftKey ? LEAP_S : STEP_S));
    else if (leap) this.seek(this.time + leap);
    else if (event.key === " ") this.toggle();
    else return;
    event.preventDefault();
  }

  #icon() {
    this.button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    for (const [name, value] of [["viewBox", "0 0 20 20"], ["width", 20], ["height", 20], ["aria-hidden", "true"]]) {
      svg.setAttribute(name, value);
    }
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", this.playing ? PAUSE : PLAY);
    path.setAttribute("fill", "currentColor");
    svg.append(path);
    this.button.replaceChildren(svg);
  }
}

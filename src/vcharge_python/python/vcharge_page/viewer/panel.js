// The list of layers, and the bar of time.

export class LayerList {
  constructor(element, onChange) {
    this.element = element;
    this.onChange = onChange;
    this.boxes = [];
  }

  /** Adds a layer with its objects of the scene. */
  add(name, objects, isOn = true) {
    const label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.checked = isOn;
    box.dataset.layer = name;
    const show = () => {
      for (const object of objects) {
        object.visible = box.checked;
      }
      this.onChange();
    };
    box.addEventListener("change", show);
    label.append(box, ` ${this.boxes.length + 1} ${name}`);
    this.element.append(label);
    this.boxes.push(box);
    show();
  }

  toggle(number) {
    if (this.boxes[number]) {
      this.boxes[number].click();
    }
  }
}

export class TimeBar {
  /** `drives` with `duration_s` and `session`; `onChange(number of the drive, time in s)`. */
  constructor(drives, onChange) {
    const byId = (id) => document.getElementById(id);
    [this.slider, this.clock, this.select, this.button] = ["slider", "clock", "session", "play"].map(byId);
    this.drives = drives;
    this.onChange = onChange;
    this.isPlaying = false;
    byId("time").hidden = !drives.some((drive) => drive.times_s.length);
    this.select.hidden = drives.length < 2;
    drives.forEach((drive, i) => this.select.add(new Option(drive.session.name, String(i))));
    this.slider.addEventListener("input", () => this.show());
    this.select.addEventListener("change", () => this.choose());
    this.button.addEventListener("click", () => this.play(!this.isPlaying));
    const first = drives.findIndex((drive) => drive.times_s.length);
    this.select.value = String(Math.max(first, 0));
  }

  get time_s() {
    return Number(this.slider.value);
  }

  choose() {
    this.slider.max = String(this.drives[Number(this.select.value)].duration_s);
    this.slider.value = "0";
    this.show();
  }

  set(time_s) {
    this.slider.value = String(time_s);
    this.show();
  }

  show() {
    this.clock.textContent = `${this.time_s.toFixed(1)} of ${Number(this.slider.max).toFixed(1)} s`;
    this.onChange(Number(this.select.value), this.time_s);
  }

  play(isPlaying) {
    this.isPlaying = isPlaying;
    this.button.setAttribute("aria-pressed", isPlaying);
    let last = performance.now();
    const advance = (now) => {
      if (!this.isPlaying) {
        return;
      }
      const following = this.time_s + (now - last) / 1000;
      last = now;
      this.set(following < Number(this.slider.max) ? following : 0);
      requestAnimationFrame(advance);
    };
    if (isPlaying) {
      requestAnimationFrame(advance);
    }
  }

  /** Whether the key was one of the bar's. */
  pressKey(key, isFar) {
    const step_s = {ArrowRight: 0.2, ArrowLeft: -0.2}[key];
    if (step_s) {
      this.set(this.time_s + step_s * (isFar ? 10 : 1));
    } else if (key === " ") {
      this.play(!this.isPlaying);
    }
    return Boolean(step_s) || key === " ";
  }
}

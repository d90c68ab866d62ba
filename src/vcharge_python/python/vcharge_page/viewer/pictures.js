// The images of the cameras at the keyframe nearest in time.

import {pictureAddress} from "./data.js";

export class Pictures {
  /** `entries`: `session`, `timeS`, and places by camera of each keyframe. */
  constructor(section, entries) {
    this.entries = entries;
    this.shown = null;
    this.images = {};
    section.hidden = entries.length === 0;
    for (const camera of new Set(entries.flatMap((entry) => Object.keys(entry.images)))) {
      const figure = document.createElement("figure"), caption = document.createElement("figcaption");
      this.images[camera] = document.createElement("img");
      this.images[camera].alt = `image of camera ${camera}`;
      caption.textContent = camera;
      figure.append(this.images[camera], caption);
      section.append(figure);
    }
  }

  show(session, time_s) {
    let best = null;
    for (const entry of this.entries) {
      if (entry.session === session && (!best || Math.abs(entry.timeS - time_s) < Math.abs(best.timeS - time_s))) {
        best = entry;
      }
    }
    if (best === this.shown) {
      return;
    }
    this.shown = best;
    for (const [camera, image] of Object.entries(this.images)) {
      const place = best && best.images[camera];
      if (place) {
        image.src = pictureAddress("pictures", ...place);
      } else {
        image.removeAttribute("src");
      }
    }
  }
}

// The range image: a pixel of the sensor for each of its own, in the colours of the cloud.

class RangeImage {
  constructor(canvas, marker) {
    this.canvas = canvas;
    this.marker = marker;
    this.pen = canvas.getContext("2d");
  }

  // Paints `cloud` by a scale. Pixels without a return have the ground's colour or, where outcomes
  // are shown, that of theirs.
  paint(cloud, { column, shades, table }, nothing) {
    const { rows, columns, image, outcomes } = cloud;
    this.cloud = cloud;
    this.canvas.width = columns;
    this.canvas.height = rows;
    const picture = this.pen.createImageData(columns, rows);
    const shown = column === "outcome" ? outcomes : null;
    for (let pixel = 0; pixel < image.length; pixel += 1) {
      const at = image[pixel];
      const shade = at >= 0 ? shades[at] : shown ? shown[pixel] + 1 : -1;
      const isDrawn = shade >= 0 && table[4 * shade + 3] > 0;
      for (let part = 0; part < 3; part += 1) {
        picture.data[4 * pixel + part] = isDrawn ? table[4 * shade + part] : nothing[part];
      }
      picture.data[4 * pixel + 3] = 255;
    }
    this.pen.putImageData(picture, 0, 0);
  }

  // Row and column under a pointer.
  pixelAt(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (place, from, span, count) =>
      Math.min(Math.max(Math.floor(((place - from) / span) * count), 0), count - 1);
    return [
      share(event.clientY, box.top, box.height, this.cloud.rows),
      share(event.clientX, box.left, box.width, this.cloud.columns),
    ];
  }

  // Marks a pixel, or none.
  mark(pixel) {
    this.marker.hidden = !pixel;
    if (!pixel) return;
    this.marker.style.left = `${(100 * (pixel[1] + 0.5)) / this.cloud.columns}%`;
    this.marker.style.top = `${(100 * (pixel[0] + 0.5)) / this.cloud.rows}%`;
  }
}

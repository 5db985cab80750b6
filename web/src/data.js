// Reads what the page brings along: a table of contents (JSON) and one compressed block of arrays.

const KINDS = {
  float32: Float32Array,
  uint32: Uint32Array,
  int16: Int16Array,
  uint16: Uint16Array,
  uint8: Uint8Array,
};

/** Return the corners of all triangles from their codes: steps back from the newest corner. */
export function unpackFaces(codes) {
  const faces = new Uint16Array(codes.length);
  let seen = 0;
  codes.forEach((code, k) => {
    faces[k] = seen - code;
    if (code === 0) seen++;
  });
  return faces;
}

/** Return the edges, two corners each, from the flags at the sides of the triangles. */
export function unpackEdges(faces, flags) {
  const edges = [];
  flags.forEach((flag, k) => {
    for (let c = 0; c < 3; c++) {
      if (flag & (1 << c)) edges.push(faces[3 * k + c], faces[3 * k + ((c + 1) % 3)]);
    }
  });
  return new Uint16Array(edges);
}

/** Unpack the block; return the contents, and a function that opens a model in it. */
export async function readPage() {
  const contents = JSON.parse(document.getElementById("contents").textContent);
  const text = document.getElementById("block").textContent.trim();
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const array = (place) => new KINDS[place.type](buffer, place.at, place.length);
  return { contents, open: (model) => openModel(model, array) };
}

/** Return a model: its table of contents, what finds its arrays, and its parts. */
function openModel(contents, array) {
  const told = JSON.parse(new TextDecoder().decode(array(contents.parts)));
  const energies = array(contents.energy);
  const parts = told.rows.map(
    ([number, name, color, submodel, step, line, fastener, standIn], index) => ({
      index,
      number: told.words[number],
      name: told.words[name],
      color: told.words[color],
      submodel: told.words[submodel],
      step,
      line,
      fastener: fastener === 1,
      standIn: standIn === 1,
      energy: energies[index],
    }),
  );
  return { contents, array, parts };
}

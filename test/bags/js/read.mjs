// Reads .mcap files as Foxglove does. For each line on stdin, a JSON list of paths, it prints a line
// of JSON: every file's topics with the number of decoded messages, the first and the last of them,
// and their times in nanoseconds.

import { open } from "node:fs/promises";
import { createInterface } from "node:readline";

import rosmsg from "@foxglove/rosmsg";
import rosmsg2 from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const decompressHandlers = await loadDecompressHandlers();

function plain(_key, value) {
  if (typeof value === "bigint") return value.toString();
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
}

function readable(file) {
  return {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
      if (bytesRead !== bytes.length) throw new Error(`only ${bytesRead} bytes at ${offset}`);
      return bytes;
    },
  };
}

async function read(path) {
  const file = await open(path);
  const reader = await McapIndexedReader.Initialize({ readable: readable(file), decompressHandlers });
  const decoders = new Map();
  const topics = {};
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    decoders.set(channel.id, new rosmsg2.MessageReader(rosmsg.parse(text, { ros2: true })));
    topics[channel.topic] = { type: schema.name, encoding: schema.encoding, count: 0 };
  }
  let before = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < before) throw new Error("not in the order of log times");
    before = message.logTime;
    const topic = topics[reader.channelsById.get(message.channelId).topic];
    const value = decoders.get(message.channelId).readMessage(message.data);
    const read = { logTime: message.logTime, publishTime: message.publishTime, value };
    topic.first ??= read;
    topic.last = read;
    topic.count += 1;
  }
  const attachments = [];
  for await (const a of reader.readAttachments()) {
    attachments.push({ name: a.name, text: new TextDecoder().decode(a.data) });
  }
  await file.close();
  return { profile: reader.header.profile, topics, attachments };
}

for await (const line of createInterface({ input: process.stdin })) {
  const files = [];
  for (const path of JSON.parse(line)) files.push(await read(path));
  console.log(JSON.stringify(files, plain));
}

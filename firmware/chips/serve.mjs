// A board on an emulated chip, for a program that is the PC at the other end of its link: an order a line, an answer a line.
//
//   image ADDRESS FILE      writes a file into the flash; the program as ELF or UF2 without an address
//   start                   power-on
//   run MICROSECONDS [HEX]  the line takes these bytes; answers with the bytes sent: hexadecimal, or -
//   usb MICROSECONDS [HEX]  the same with the serial port at the USB socket
//   plug | unplug           the cable of the USB socket
//   suspend | resume        the PC at it sleeps, and wakes
//   truth MICROSECONDS      the pose at a time of the chip's clock
//   state                   time in microseconds, pose, pings, whether the motors are enabled; when a motor last had a voltage, and when
//                           an encoder last changed, in microseconds
//   events                  what has happened since the last time: words and nanoseconds
//   chip                    instructions, overruns, lost bytes, erased sectors, programmed pages, short triggers
//   count ADDRESS           counts the calls of the function there
//   calls                   how many have returned; the instructions of the longest one with the motors enabled, and of the longest other one
//   pings                   how many pings each sonar has sent
//   gyro                    how many samples of the gyro have been read
//   pull PIN                up, down or none
//   hang | fault | overflow at the next instruction
//   off-and-on              the power goes and comes again
//   loop                    a wire from the pin of the servo to that of the echo, and no sonar
//   noise on|off            random bytes at the full rate of the line
//   cut STEPS               cuts the power in this step of the flash from now
//   slow-flash              the longest times of the flash's data sheet
//   unknown                 what the emulator lacks
import fs from 'node:fs';
import path from 'node:path';
import readline from 'node:readline';
import { Board } from './board.mjs';
import { Stm32Board } from './stm32-board.mjs';
import { WIRINGS } from './wirings.mjs';

const [, , worldFile] = process.argv;
const world = JSON.parse(fs.readFileSync(worldFile, 'utf8'));
const board = world.board in WIRINGS ? new Board(world) : new Stm32Board(world, path.dirname(worldFile));

const orders = {
  image(...words) {
    const [file, at] = words.reverse();
    board.load(fs.readFileSync(file), at === undefined ? null : Number(at), file);
  },
  start: () => board.start(),
  async run(micros, hex = '') {
    board.toSend.push(...Buffer.from(hex, 'hex'));
    await board.run(board.now + 1e3 * Number(micros));
    return Buffer.from(board.received.splice(0)).toString('hex') || '-';
  },
  async usb(micros, hex = '') {
    board.usb.send(Buffer.from(hex, 'hex'));
    await board.run(board.now + 1e3 * Number(micros));
    return Buffer.from(board.receivedByUsb.splice(0)).toString('hex') || '-';
  },
  plug: () => board.plug(),
  unplug: () => board.unplug(),
  suspend: () => board.usb.suspend(),
  resume: () => board.usb.resume(),
  truth: (micros) => board.poseAt(1e3 * Number(micros)).slice(1).join(' '),
  state() {
    const { room } = board;
    const last = [board.poweredAt, board.rolledAt].map((nanos) => nanos / 1e3);
    return [board.now / 1e3, room.x, room.y, room.heading, board.sonar.pings, Number(board.isEnabled), ...last].join(' ');
  },
  events: () => board.events.splice(0).join(' ') || '-',
  chip: () => board.counters().join(' '),
  count(at) { board.polls.at = Number(at); },
  calls: () => [board.polls.returned, board.polls.driving, board.polls.waiting].join(' '),
  pings: () => board.room.sonars.map((sonar) => sonar.pings).join(' '),
  gyro: () => board.gyro.readings,
  pull(pin) {
    const { pullupEnabled, pulldownEnabled } = board.chip.rp2040.gpio[Number(pin)];
    return pullupEnabled ? 'up' : pulldownEnabled ? 'down' : 'none';
  },
  hang: () => board.hang(),
  fault: () => board.failAtInstruction(),
  overflow: () => board.chip.overflowStack(),
  'off-and-on': () => board.reset('power'),
  loop: () => board.loop(),
  noise(state) { board.isNoisy = state === 'on'; },
  cut(steps) { board.steps.left = Number(steps); },
  'slow-flash': () => board.slowFlash(),
  unknown: () => [...board.chip.unknown].map(([text, count]) => `${text} (${count})`).join('; ') || '-',
};

for await (const line of readline.createInterface({ input: process.stdin })) {
  const [order, ...words] = line.trim().split(' ');
  try {
    console.log((await orders[order](...words)) ?? 'ok');
  } catch (error) {
    console.log(`error ${order}: ${error.stack.replaceAll('\n', ' | ')}`);
  }
}

//! A frame in flight: recorded once, submitted many times, never waited for unless its own last submission still runs.
//!
//! All frames run on one queue, one after another, and share the plan's images and buffers. What a frame holds for itself is what the host
//! writes before it and reads after it: inputs and outputs. Where resources have history, it has commands for each of two turns.

use afterlight_gpu::{self as gpu, Device, GpuError, vk};

use super::builder::image_to_buffer;
use super::read_back::{ANY, ANY_WRITE, COPY_READ, ImageCopy};
use super::{Executor, Marks, Turn};
use crate::declare::ResourceId;
use crate::error::GraphError;
use crate::execute::resources::Physical;

const COPY_WRITE: gpu::Access =
    gpu::Access { stages: vk::PipelineStageFlags2::ALL_TRANSFER, access: vk::AccessFlags2::TRANSFER_WRITE };

/// Copies of buffers begin at multiples of this, bytes.
const COPY_ALIGNMENT: u64 = 16;

/// Where something lies in a buffer that the host reaches, bytes.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: u64,
    bytes: u64,
}

/// Room for places one after another.
#[derive(Default)]
struct Room {
    bytes: u64,
}

impl Room {
    fn place(&mut self, bytes: u64) -> Place {
        let place = Place { offset: self.bytes.next_multiple_of(COPY_ALIGNMENT), bytes };
        self.bytes = place.offset + bytes;
        place
    }

    fn buffer(
        &self,
        device: &Device,
        name: &str,
        memory: gpu::MemoryKind,
    ) -> Result<Option<gpu::Buffer>, GpuError> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let desc = gpu::BufferDesc { name, bytes: self.bytes, usage, memory };
        (self.bytes > 0).then(|| device.create_buffer(&desc)).transpose()
    }
}

/// What the host writes before each frame.
#[derive(Clone, Debug)]
pub enum FrameInput {
    /// A buffer, as a whole.
    Buffer(gpu::Buffer),
    /// The first level and layer of a colour image in the layout `SHADER_READ_ONLY_OPTIMAL`, rows tightly packed.
    Image(gpu::Image),
}

impl FrameInput {
    /// Its bytes; none of an image whose format has no known size.
    pub fn bytes(&self) -> u64 {
        match self {
            FrameInput::Buffer(buffer) => buffer.bytes(),
            FrameInput::Image(image) => {
                let [width, height] = image.extent();
                gpu::format_info(image.format()).map_or(0, |info| info.level_bytes(width, height))
            }
        }
    }

    /// Records the copy from `offset` bytes on.
    fn record(&self, encoder: &mut gpu::Encoder, from: &gpu::Buffer, offset: u64) -> Result<(), GpuError> {
        let image = match self {
            FrameInput::Buffer(buffer) => {
                return encoder.copy_buffer(from, offset, buffer, 0, buffer.bytes());
            }
            FrameInput::Image(image) => image,
        };
        let color = vk::ImageAspectFlags::COLOR;
        let mut barrier = gpu::ImageBarrier {
            image,
            range: vk::ImageSubresourceRange {
                aspect_mask: color,
                base_mip_level: 0,
                level_count: 1,
                base_array_layer: 0,
                layer_count: 1,
            },
            before: ANY,
            after: COPY_WRITE,
            old_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            new_layout: vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        };
        encoder.barriers(&[], &[], &[barrier]);
        encoder.copy_buffer_to_image(from, image, &[image_to_buffer(image, color, 0, 0, offset)]);
        std::mem::swap(&mut barrier.old_layout, &mut barrier.new_layout);
        (barrier.before, barrier.after) = (COPY_WRITE, ANY);
        encoder.barriers(&[], &[], &[barrier]);
        Ok(())
    }
}

/// When the device worked on a frame, nanoseconds by its own clock, and how long the passes took. All empty or `None` where it has no
/// timestamps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// When it began, inputs included.
    pub start_ns: Option<f64>,
    /// When it was done, outputs included.
    pub end_ns: Option<f64>,
    /// From the first pass to the last, as [`FrameReport::frame_ns`](crate::FrameReport::frame_ns).
    pub frame_ns: Option<f64>,
    /// A time a pass, in the order of the plan.
    pub pass_ns: Vec<f64>,
}

/// A frame of an [`Executor`] that waits for its next submission, or is in flight.
pub struct FrameSlot {
    ends: Ends,
    /// One a turn.
    recorded: Vec<Recorded>,
    /// The turn of its last submission.
    turn: Turn,
    completed: gpu::Completed,
    times: FrameTimes,
}

impl Executor {
    /// Records a frame to be submitted many times. Before its first pass `inputs` are overwritten by what [`FrameSlot::write`] was given
    /// last; after its last pass kept or imported resources, the `outputs`, are copied to where [`FrameSlot::read`] finds them.
    ///
    /// # Errors
    /// An output that [`Executor::read_image`] or [`Executor::read_buffer`] would refuse, no memory, a recording that the device refuses.
    pub fn slot(&self, inputs: &[FrameInput], outputs: &[ResourceId]) -> Result<FrameSlot, GraphError> {
        self.slot_for(inputs, outputs, false)
    }

    /// The same for a frame that goes into another program's command buffer ([`FrameSlot::execute_in`]) and is never submitted.
    ///
    /// # Errors
    /// As [`Executor::slot`].
    pub fn slot_for_callers(
        &self,
        inputs: &[FrameInput],
        outputs: &[ResourceId],
    ) -> Result<FrameSlot, GraphError> {
        self.slot_for(inputs, outputs, true)
    }

    fn slot_for(
        &self,
        inputs: &[FrameInput],
        outputs: &[ResourceId],
        for_callers: bool,
    ) -> Result<FrameSlot, GraphError> {
        let mut room = Room::default();
        let inputs: Vec<_> = inputs.iter().map(|input| (input.clone(), room.place(input.bytes()))).collect();
        let written = room.buffer(&self.device, "frame inputs", gpu::MemoryKind::Upload)?;

        let mut room = Room::default();
        let mut copied = |id: &ResourceId| {
            let copies = self.turns().iter().map(|turn| self.copied(*id, *turn));
            let copies = copies.collect::<Result<Vec<_>, _>>()?;
            let place = room.place(copies[0].bytes());
            Ok((copies, place))
        };
        let outputs = outputs.iter().map(&mut copied).collect::<Result<Vec<_>, GraphError>>()?;
        let read = room.buffer(&self.device, "frame outputs", gpu::MemoryKind::Readback)?;
        let ends = Ends { written, inputs, read, outputs, for_callers };
        let recorded =
            self.turns().iter().map(|turn| self.record_between(&ends, *turn)).collect::<Result<_, _>>()?;
        let (completed, times) = (gpu::Completed::default(), FrameTimes::default());
        Ok(FrameSlot { ends, recorded, turn: Turn::default(), completed, times })
    }

    /// What is copied of an output after frames of a turn.
    fn copied(&self, id: ResourceId, turn: Turn) -> Result<Copied, GraphError> {
        match &self.bound(turn).physical[self.find(&id)?.0 as usize] {
            Physical::Buffer(buffer) => Ok(Copied::Buffer(buffer.clone())),
            _ => Ok(Copied::Image(self.image_copy(&id, turn)?)),
        }
    }

    /// Records the frame of a slot anew for a turn, with the scripts as they are now. Waits for its last submission.
    ///
    /// # Errors
    /// The device was lost, a recording that it refuses.
    pub fn record_again(&self, slot: &mut FrameSlot, turn: Turn) -> Result<(), GraphError> {
        slot.wait()?;
        let place = turn.index() % slot.recorded.len();
        slot.recorded[place] = self.record_between(&slot.ends, turn)?;
        Ok(())
    }

    fn record_between(&self, ends: &Ends, turn: Turn) -> Result<Recorded, GraphError> {
        let mut encoder = match ends.for_callers {
            true => self.device.encoder_for_callers()?,
            false => self.device.encoder_for_many()?,
        };
        after_earlier_frames(&mut encoder);
        let start = encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?;
        if let Some(written) = &ends.written {
            for (input, place) in &ends.inputs {
                input.record(&mut encoder, written, place.offset)?;
            }
            encoder.barriers(&[gpu::MemoryBarrier { before: ANY_WRITE, after: ANY }], &[], &[]);
        }
        let marks = self.record(&mut encoder, turn, false)?;
        if let Some(read) = &ends.read {
            encoder.barriers(&[gpu::MemoryBarrier { before: ANY_WRITE, after: COPY_READ }], &[], &[]);
            for (copies, place) in &ends.outputs {
                match &copies[turn.index() % copies.len()] {
                    Copied::Buffer(buffer) => {
                        encoder.copy_buffer(buffer, 0, read, place.offset, place.bytes)?
                    }
                    Copied::Image(copy) => copy.record(&mut encoder, read, place.offset),
                }
            }
        }
        let end = encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?;
        Ok(Recorded { recording: encoder.finish()?, marks, start, end })
    }
}

/// What the host writes before a frame and reads after it.
struct Ends {
    written: Option<gpu::Buffer>,
    inputs: Vec<(FrameInput, Place)>,
    read: Option<gpu::Buffer>,
    /// A copy a turn.
    outputs: Vec<(Vec<Copied>, Place)>,
    /// Whether another program's command buffer executes the frame.
    for_callers: bool,
}

/// A frame's commands, and the times that they take.
struct Recorded {
    recording: gpu::Recording,
    marks: Marks,
    start: gpu::TimestampId,
    end: gpu::TimestampId,
}

/// What is copied at the end of a frame.
enum Copied {
    Buffer(gpu::Buffer),
    Image(ImageCopy),
}

impl Copied {
    fn bytes(&self) -> u64 {
        match self {
            Copied::Buffer(buffer) => buffer.bytes(),
            Copied::Image(copy) => copy.bytes(),
        }
    }
}

/// Frames share their memory: the next one begins where the last has ended.
pub(super) fn after_earlier_frames(encoder: &mut gpu::Encoder) {
    encoder.barriers(&[gpu::MemoryBarrier { before: ANY, after: ANY }], &[], &[]);
}

impl FrameSlot {
    /// The commands of the last submission.
    fn submitted(&self) -> &Recorded {
        &self.recorded[self.turn.index() % self.recorded.len()]
    }

    /// The commands of a turn, of which the next submission is. The host reads and writes one memory for both turns: the last submission is
    /// waited for.
    fn take_turn(&mut self, turn: Turn) -> Result<&mut Recorded, GraphError> {
        if turn != self.turn {
            self.wait()?;
            self.turn = turn;
        }
        let place = turn.index() % self.recorded.len();
        Ok(&mut self.recorded[place])
    }

    /// Lets `write` fill input number `input`, as long as its buffer; waits for the slot's last submission. What is not written stays as
    /// the slot had it last.
    ///
    /// # Errors
    /// The device was lost.
    pub fn write(&mut self, input: usize, write: impl FnOnce(&mut [u8])) -> Result<(), GraphError> {
        self.wait()?;
        let place = self.ends.inputs[input].1;
        let Some(written) = &self.ends.written else { return Ok(()) };
        let [from, end] = [place.offset, place.offset + place.bytes].map(|at| at as usize);
        Ok(written.with_mapped_mut(|bytes| write(&mut bytes[from..end]))?)
    }

    /// Submits the frame of a turn and returns at once; only its own last submission is waited for. Without history all turns are one.
    ///
    /// # Errors
    /// The device was lost.
    pub fn submit(&mut self, turn: Turn) -> Result<(), GraphError> {
        Ok(self.take_turn(turn)?.recording.submit()?)
    }

    /// Adds the frame of a turn to another program's command buffer, and a copy of `picture`, a kept colour image of the executor that the
    /// frame is of, to its image.
    ///
    /// # Errors
    /// A picture that [`Executor::read_image`] would refuse; a target of a format that it cannot be copied to.
    ///
    /// # Panics
    /// If the frame was not recorded for that, or is with another command buffer.
    pub fn execute_in(
        &mut self,
        executor: &Executor,
        (picture, turn): (ResourceId, Turn),
        commands: &gpu::CallersCommands,
        target: &gpu::Target,
    ) -> Result<(), GraphError> {
        assert!(self.ends.for_callers, "a frame that is submitted is added to another program's commands");
        let copy = executor.image_copy(&picture, turn)?;
        executor.device.check_target(target)?;
        executor.device.execute_in(commands, &mut self.take_turn(turn)?.recording);
        copy.to_target(&executor.device, commands, target)
    }

    /// The device is done with the command buffer that the frame was added to, or it will never be submitted.
    pub fn release_from_caller(&mut self) {
        for recorded in &mut self.recorded {
            recorded.recording.release_from_caller();
        }
    }

    /// Waits for the last submission.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&mut self) -> Result<(), GraphError> {
        let place = self.turn.index() % self.recorded.len();
        Ok(self.recorded[place].recording.wait()?)
    }

    /// Whether the device has nothing of the frame left to do.
    ///
    /// # Errors
    /// The device was lost.
    pub fn is_done(&self) -> Result<bool, GraphError> {
        Ok(self.submitted().recording.is_done()?)
    }

    /// Waits for the last submission and returns its times.
    ///
    /// # Errors
    /// The device was lost.
    pub fn finish(&mut self) -> Result<&FrameTimes, GraphError> {
        let place = self.turn.index() % self.recorded.len();
        let recorded = &mut self.recorded[place];
        recorded.recording.collect(&mut self.completed)?;
        let (completed, times) = (&self.completed, &recorded.marks.times);
        self.times.start_ns = completed.ns(recorded.start);
        let whole_ns = completed.elapsed_ns(recorded.start, recorded.end);
        self.times.end_ns = self.times.start_ns.zip(whole_ns).map(|(start_ns, whole_ns)| start_ns + whole_ns);
        self.times.frame_ns = completed.elapsed_ns(times[0], times[times.len() - 1]);
        self.times.pass_ns.clear();
        self.times.pass_ns.extend(times.windows(2).filter_map(|pair| completed.elapsed_ns(pair[0], pair[1])));
        Ok(&self.times)
    }

    /// Lets `read` see output number `output` of the last submission, which is waited for.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read<T>(&mut self, output: usize, read: impl FnOnce(&[u8]) -> T) -> Result<T, GraphError> {
        self.wait()?;
        let place = self.ends.outputs[output].1;
        let [from, end] = [place.offset, place.offset + place.bytes].map(|at| at as usize);
        match &self.ends.read {
            Some(buffer) => Ok(buffer.with_mapped_mut(|bytes| read(&bytes[from..end]))?),
            None => Ok(read(&[])),
        }
    }

    /// Waits for the last submission, and lets `read` see its times and output number `output`, where one is named.
    ///
    /// # Errors
    /// The device was lost.
    pub fn finish_and_read<T>(
        &mut self,
        output: Option<usize>,
        read: impl FnOnce(&FrameTimes, Option<&[u8]>) -> T,
    ) -> Result<T, GraphError> {
        self.finish()?;
        let Some(output) = output else { return Ok(read(&self.times, None)) };
        // Lent out, since the reading borrows the slot.
        let times = std::mem::take(&mut self.times);
        let seen = self.read(output, |bytes| read(&times, Some(bytes)));
        self.times = times;
        seen
    }

    /// Bytes that the slot holds beside the plan, which all slots share.
    pub fn bytes(&self) -> u64 {
        [&self.ends.written, &self.ends.read].into_iter().flatten().map(gpu::Buffer::allocated_bytes).sum()
    }
}

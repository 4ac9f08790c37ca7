//! Commands that are recorded: submitted, waited for, asked what they took, any number of times.

use crate::device::{Submission, lost};
use crate::encoder::{Completed, Held, statistics};
use crate::recorder::{Recorder, query_results};
use crate::{Device, GpuError};

/// Recorded commands with everything that they use. They run once at a time: a submission waits on the host until the one before is done.
pub struct Recording {
    device: Device,
    /// `None` only once dropped.
    recorder: Option<Recorder>,
    /// Kept alive until the device is done with it.
    _held: Vec<Held>,
    labels: Vec<String>,
    timestamp_count: u32,
    statistics_count: u32,
    /// The last submission, if it may still run.
    running: Option<Submission>,
    /// Whether another program's command buffer has them.
    is_with_caller: bool,
    /// What the device counted since the queries were reset, as it gives it.
    counts: Vec<[u64; 7]>,
    has_run: bool,
}

impl Recording {
    pub(crate) fn new(
        device: Device,
        recorder: Recorder,
        held: Vec<Held>,
        labels: Vec<String>,
        [timestamp_count, statistics_count]: [u32; 2],
    ) -> Recording {
        Recording {
            device,
            recorder: Some(recorder),
            _held: held,
            labels,
            timestamp_count,
            statistics_count,
            running: None,
            is_with_caller: false,
            counts: Vec::new(),
            has_run: false,
        }
    }

    /// Submits the commands once more and returns at once, unless their last submission still runs: that one is waited for.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], a submission that the driver refuses.
    pub fn submit(&mut self) -> Result<(), GpuError> {
        self.wait()?;
        let commands = self.make_ready();
        let submitted =
            self.device.submit_raw(commands).map_err(|result| self.lost("vkQueueSubmit2", result))?;
        self.running = Some(submitted);
        self.has_run = true;
        Ok(())
    }

    /// Makes queries and checkpoints ready for the commands to run once more, and returns the commands.
    fn make_ready(&mut self) -> ash::vk::CommandBuffer {
        let label_count = self.labels.len();
        let recorder = self.recorder.as_mut().expect("a recording has its recorder until it is dropped");
        if self.has_run {
            recorder.reset_queries(&self.device.0.raw);
        }
        if let Some(checkpoints) = &mut recorder.checkpoints {
            checkpoints.clear(label_count);
        }
        recorder.commands
    }

    /// Hands the commands over to another program's command buffer, until [`Recording::release_from_caller`].
    pub(crate) fn hand_over(&mut self) -> ash::vk::CommandBuffer {
        assert!(
            self.running.is_none() && !self.is_with_caller,
            "commands that may still run are handed over"
        );
        let commands = self.make_ready();
        (self.is_with_caller, self.has_run) = (true, true);
        commands
    }

    /// The device is done with the command buffer that has the commands, or it will never be submitted: see
    /// [`CallersCommands`](crate::CallersCommands).
    pub fn release_from_caller(&mut self) {
        self.is_with_caller = false;
    }

    /// Whether the device has nothing of it left to do.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`].
    pub fn is_done(&self) -> Result<bool, GpuError> {
        let Some(submission) = self.running else { return Ok(!self.is_with_caller) };
        self.device.has_done(submission).map_err(|result| self.lost("vkGetSemaphoreCounterValue", result))
    }

    /// Waits until the last submission is done.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] with the last label whose end was reached; [`GpuError::WithCaller`].
    pub fn wait(&mut self) -> Result<(), GpuError> {
        if self.is_with_caller {
            return Err(GpuError::WithCaller);
        }
        if let Some(submission) = self.running {
            self.device.wait_for(submission).map_err(|result| self.lost("vkWaitSemaphores", result))?;
            self.running = None;
        }
        Ok(())
    }

    /// Puts the timestamps and statistics of the last submission into `completed`, whose memory is used again. Waits for it first.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`].
    ///
    /// # Panics
    /// If the commands have never been submitted.
    pub fn collect(&mut self, completed: &mut Completed) -> Result<(), GpuError> {
        assert!(self.has_run, "times of commands that never ran");
        self.wait()?;
        let features = self.device.features();
        let valid_bits = features.timestamp_valid_bits;
        completed.tick_mask = match valid_bits {
            0 => 0,
            64.. => u64::MAX,
            bits => (1 << bits) - 1,
        };
        completed.tick_ns = f64::from(features.timestamp_period_ns);
        let raw = &self.device.0.raw;
        let recorder = self.recorder.as_ref().expect("a recording has its recorder until it is dropped");
        let timestamp_count = if valid_bits > 0 { self.timestamp_count } else { 0 };
        if !query_results::<u64>(raw, &recorder.timestamp_pools, timestamp_count, &mut completed.ticks)? {
            // The caller's command buffer was never submitted.
            completed.tick_mask = 0;
        }
        let statistics_count = if features.pipeline_statistics { self.statistics_count } else { 0 };
        query_results::<[u64; 7]>(raw, &recorder.statistics_pools, statistics_count, &mut self.counts)?;
        completed.statistics.clear();
        completed.statistics.extend(self.counts.iter().copied().map(statistics));
        Ok(())
    }

    /// The last label of the submission whose end the device has reached.
    pub(crate) fn last_label(&self) -> Option<&str> {
        let checkpoints = self.recorder.as_ref()?.checkpoints.as_ref()?;
        checkpoints.last_reached(self.labels.len()).map(|i| self.labels[i].as_str())
    }

    fn lost(&self, call: &'static str, result: ash::vk::Result) -> GpuError {
        lost(call, self.last_label().unwrap_or("none"))(result)
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        // A lost device has stopped using the resources too, so that they may go.
        let _ = self.wait();
        if let Some(recorder) = self.recorder.take() {
            self.device.give_back(recorder);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{BufferDesc, Completed, Device, DeviceOptions, MemoryKind};
    use ash::vk;

    #[test]
    fn the_last_label_reached_is_known() {
        let device = Device::open(&DeviceOptions::default()).expect("a device");
        // Twice, since the second encoder gets the words of the first.
        for names in [&["a", "b", "c"][..], &["d"], &[]] {
            let mut encoder = device.encoder().expect("an encoder");
            for name in names {
                encoder.begin_label(name);
                encoder.end_label();
            }
            encoder.begin_label("never closed");
            let mut recording = encoder.finish().expect("recorded");
            recording.submit().expect("submitted");
            recording.wait().expect("done");
            assert_eq!(recording.last_label(), names.last().copied());
        }
    }

    /// Commands run as often as they are submitted, see what the host wrote in between, and tell the times of the last run.
    #[test]
    fn commands_run_as_often_as_they_are_submitted() {
        let device = Device::open(&DeviceOptions::default()).expect("a device");
        let buffer = |name, memory| {
            let usage = vk::BufferUsageFlags::TRANSFER_SRC;
            device.create_buffer(&BufferDesc { name, bytes: 4, usage, memory }).expect("a buffer")
        };
        let (from, to) = (buffer("from", MemoryKind::Upload), buffer("to", MemoryKind::Readback));
        let mut encoder = device.encoder_for_many().expect("an encoder");
        let start = encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS).expect("a query");
        encoder.copy_buffer(&from, 0, &to, 0, 4).expect("in range");
        let end = encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS).expect("a query");
        let mut recording = encoder.finish().expect("recorded");
        assert!(recording.is_done().expect("a device"), "what was never submitted does not run");
        let mut completed = Completed::default();
        let mut last_tick = None;
        for round in 1u32..=3 {
            from.write(0, &round.to_le_bytes()).expect("mapped");
            recording.submit().expect("submitted");
            recording.collect(&mut completed).expect("done");
            assert!(recording.is_done().expect("a device"));
            let mut word = [0; 4];
            to.read(0, &mut word).expect("mapped");
            assert_eq!(u32::from_le_bytes(word), round);
            if let Some(elapsed_ns) = completed.elapsed_ns(start, end) {
                assert!(elapsed_ns >= 0.0);
                let tick = completed.ns(end);
                assert!(tick > last_tick, "{tick:?} after {last_tick:?}");
                last_tick = tick;
            }
        }
    }
}

//! The cost of a point: steps of work, and the memory of the objects that it makes.
//!
//! The count does not depend on time, so a program ends at the same place on every machine. A batch is
//! counted for all of its points at once: each block and each kernel is charged with the cost of its most
//! expensive point. So the count of a batch is never below that of any of its points, and a batch within the
//! limits contains no point beyond them. A batch beyond the limits gives no information about its points; the
//! caller runs it again in smaller batches, down to single points, for which the count is exact.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::program::SERIAL;
use osl_ir::Span;
use osl_limits::Limits;

/// Iterations of loops after which a machine checks whether the command has to end.
const ROUNDS: u64 = 1 << 12;
/// Share of the steps of a batch that kernels may spend lane by lane before the batch is run again in smaller
/// ones.
const SHARE: u64 = 8;

/// A limit that the batch has exceeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    Steps,
    Memory,
}

/// The cost of a batch so far.
#[derive(Debug, Default)]
pub(super) struct Work {
    /// The limit of steps for a point.
    limit: u64,
    /// An upper bound for the steps of every point of the batch.
    pub(super) spent: u64,
    /// An upper bound for the steps of each lane, if lanes are counted separately.
    lanes: Vec<u64>,
    /// Steps that kernels have spent lane by lane, and their limit.
    taken: u64,
    may_take: u64,
    /// Bytes of the objects made by the batch, and their limit.
    memory: u64,
    may_keep: u64,
    /// Steps of the current lane of a kernel, and the maximum over its lanes.
    lane: u64,
    most: u64,
    over: Option<Over>,
    /// Iterations of loops.
    rounds: u64,
}

impl Work {
    /// Starts the count of a batch, in which each point starts with `base` steps. With `each`, every lane has
    /// its own count.
    pub(super) fn begin(&mut self, limits: &Limits, (points, base): (usize, u64), each: bool) {
        let running = &limits.running;
        let single = points <= 1;
        self.limit = running.point_steps;
        self.spent = base;
        self.lanes.clear();
        if each && !single {
            self.lanes.resize(points, base);
        }
        let all = running.point_steps.saturating_mul(points as u64);
        (self.taken, self.may_take) = (0, if single { u64::MAX } else { all / SHARE });
        (self.memory, self.may_keep) = (0, running.point_memory);
        (self.lane, self.most, self.over) = (0, 0, None);
    }

    /// Whether each lane has its own count.
    pub(super) fn counts_lanes(&self) -> bool {
        !self.lanes.is_empty()
    }

    /// The steps that a point of the batch may still take.
    pub(super) fn left(&self) -> u64 {
        self.limit.saturating_sub(self.spent)
    }

    /// Charges all points.
    pub(super) fn add_all(&mut self, steps: u64) {
        self.spent = self.spent.saturating_add(steps);
        self.lanes.iter_mut().for_each(|lane| *lane = lane.saturating_add(steps));
    }

    /// Charges the points of a mask.
    #[cold]
    fn add_lanes(&mut self, steps: u64, mask: &Mask) {
        mask.for_each(|lane| {
            if let Some(lane) = self.lanes.get_mut(lane) {
                *lane = lane.saturating_add(steps);
            }
        });
    }

    /// The best upper bound for the steps of every point of the batch.
    fn highest(&self) -> u64 {
        self.lanes.iter().max().map_or(self.spent, |lane| self.spent.min(*lane))
    }

    /// Whether a point may exceed the limit of steps.
    fn is_beyond(&self) -> bool {
        self.spent > self.limit && self.highest() > self.limit
    }

    /// Charges the current lane of a kernel, in units of 16 nanoseconds.
    pub(super) fn pay(&mut self, units: u64) {
        self.lane = self.lane.saturating_add(units.saturating_mul(SERIAL));
    }

    /// Charges the current lane of a kernel, in steps.
    pub(super) fn pay_steps(&mut self, steps: u64) {
        self.lane = self.lane.saturating_add(steps);
    }

    /// The steps that the current lane of a kernel has been charged.
    pub(super) fn of_lane(&self) -> u64 {
        self.lane
    }

    /// Charges time that a kernel takes although a single point would not, in the same units.
    pub(super) fn delay(&mut self, units: u64) {
        self.taken = self.taken.saturating_add(units.saturating_mul(SERIAL));
    }

    /// Whether the current lane of a kernel could still spend a number of units.
    pub(super) fn affords(&mut self, units: u64) -> bool {
        let steps = units.saturating_mul(SERIAL);
        let lane = self.most.max(self.lane.saturating_add(steps));
        let fits = self.highest().saturating_add(lane) <= self.limit;
        if !fits {
            self.over.get_or_insert(Over::Steps);
        }
        fits
    }

    /// Ends the work of a kernel on a lane. Returns whether the kernel may continue.
    pub(super) fn close(&mut self) -> bool {
        self.close_all(1)
    }

    /// The same for a number of lanes. Each costs as much as the current one.
    pub(super) fn close_all(&mut self, lanes: u64) -> bool {
        let lane = std::mem::take(&mut self.lane);
        self.most = self.most.max(lane);
        self.taken = self.taken.saturating_add(lane.saturating_mul(lanes));
        if self.taken > self.may_take || self.highest().saturating_add(self.most) > self.limit {
            self.over.get_or_insert(Over::Steps);
        }
        self.over.is_none()
    }

    /// Charges the memory of an object made by the batch. Returns whether there is room for it.
    pub(super) fn keep(&mut self, bytes: u64) -> bool {
        self.memory = self.memory.saturating_add(bytes);
        let fits = self.memory <= self.may_keep;
        if !fits {
            self.over.get_or_insert(Over::Memory);
        }
        fits
    }

    /// Whether a point may make something of this size, although it is not kept.
    pub(super) fn holds(&mut self, bytes: u64) -> bool {
        let fits = bytes <= self.may_keep;
        if !fits {
            self.over.get_or_insert(Over::Memory);
        }
        fits
    }

    /// Whether the batch is within its limits as far as is known.
    pub(super) fn goes_on(&self) -> bool {
        self.over.is_none()
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The steps of a point of the last batch, if they were counted separately; otherwise those of its most
    /// expensive point.
    pub(crate) fn spent(&self, lane: usize) -> u32 {
        let steps = self.work.lanes.get(lane).copied().unwrap_or(self.work.spent);
        // Planes of ints have a sign.
        u32::try_from(steps.min(self.work.spent)).unwrap_or(u32::MAX).min(i32::MAX as u32)
    }

    /// Charges the points of a mask for a block.
    #[inline]
    pub(super) fn spend(&mut self, steps: u64, mask: &Mask) {
        self.work.spent += steps;
        if !self.work.lanes.is_empty() {
            if self.per_cell.is_running() {
                // The lanes of the mask are cells.
                self.work.lanes.iter_mut().for_each(|lane| *lane += steps);
            } else {
                self.work.add_lanes(steps, mask);
            }
        }
    }

    /// Charges the points of a mask for a kernel: `steps` for each, and the cost that it spent lane by lane.
    pub(super) fn spend_kernel(&mut self, steps: u64, mask: &Mask) {
        self.work.close();
        let most = std::mem::take(&mut self.work.most);
        self.spend(steps.saturating_add(most), mask);
    }

    /// Returns an error once a point may have exceeded a limit.
    ///
    /// # Errors
    /// A limit of a point; for a batch of several, it only means that smaller ones have to be tried.
    pub(super) fn within_limits(&self, span: Option<Span>) -> Result<(), RunError> {
        let position = self.source.blocks().map_or(self.first, |blocks| blocks.position(self.first));
        let point = self.source.pixel(position);
        if let Some(Over::Memory) = self.work.over {
            return Err(RunError::TooMuchMemory { point, bytes: self.work.may_keep, span });
        }
        if self.work.over.is_some() || self.work.is_beyond() {
            return Err(RunError::TooManySteps { point, steps: self.work.limit, span });
        }
        Ok(())
    }

    /// The same at an iteration of a loop, where the command may also have to end.
    pub(super) fn next_round(&mut self, span: Span) -> Result<(), RunError> {
        self.work.rounds = self.work.rounds.wrapping_add(1);
        if self.work.rounds.is_multiple_of(ROUNDS)
            && let Some(why) = self.limits.halted()
        {
            return Err(RunError::Halted(why));
        }
        if self.work.spent > self.work.limit { self.within_limits(Some(span)) } else { Ok(()) }
    }
}

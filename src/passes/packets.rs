//! The packets of samples that final gathering processes together, and the receivers that they belong to.

use super::gatherer::Results;
use crate::vulkan::shaders::{Packet, Span};

/// Packets in memory at a time. The result of a gather does not depend on how they are divided.
pub(super) struct Chunk {
    pub packets: Vec<Packet>,
    /// In the order of the packets. A receiver without any is listed too if its result has to be set.
    pub spans: Vec<Span>,
    /// Share of all receivers that is done with this chunk.
    pub done: f64,
}

/// Most packets of a chunk, and most of one receiver in it.
#[derive(Clone, Copy)]
pub(super) struct ChunkLimits {
    pub packets: u32,
    pub packets_of_span: u32,
}

/// Divides the packets of receivers.
pub(super) struct Chunks<'r> {
    ranges: &'r [(u32, u32)],
    first_receiver: u32,
    first_result: u32,
    /// The next receiver, and how many of its packets are done.
    receiver: usize,
    done: u32,
}

/// Divides the packets of receivers from `first_receiver` on, each with the number of its first packet and of the one after the last.
pub(super) fn chunks<'r>(
    ranges: &'r [(u32, u32)],
    first_receiver: u32,
    results: Results,
) -> Chunks<'r> {
    Chunks {
        ranges,
        first_receiver,
        first_result: results.first,
        receiver: 0,
        done: 0,
    }
}

impl Chunks<'_> {
    /// The next chunk; `None` after the last.
    pub fn next(&mut self, limits: ChunkLimits) -> Option<Chunk> {
        let mut packets = Vec::new();
        let mut spans = Vec::new();
        while let Some(&(begin, end)) = self.ranges.get(self.receiver) {
            let room = limits.packets - packets.len() as u32;
            let left = end - begin - self.done;
            let count = left.min(limits.packets_of_span).min(room);
            if room == 0 {
                break;
            }
            let receiver = self.receiver as u32;
            let adds = self.done > 0;
            if count > 0 || !adds {
                spans.push(Span {
                    result: self.first_result + receiver,
                    first_packet: packets.len() as u32,
                    packet_count: count,
                    adds: adds.into(),
                });
            }
            let first = begin + self.done;
            packets.extend((first..first + count).map(|number| Packet {
                receiver: self.first_receiver + receiver,
                number,
                begin,
                end,
            }));
            self.done += count;
            if count < left {
                break;
            }
            self.receiver += 1;
            self.done = 0;
        }
        (!spans.is_empty()).then(|| Chunk {
            packets,
            spans,
            done: self.receiver as f64 / self.ranges.len() as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(ranges: &[(u32, u32)], limits: ChunkLimits) -> Vec<Chunk> {
        let mut chunks = Chunks {
            ranges,
            first_receiver: 100,
            first_result: 10,
            receiver: 0,
            done: 0,
        };
        std::iter::from_fn(|| chunks.next(limits)).collect()
    }

    #[test]
    fn chunks_have_every_packet_once_and_in_order() {
        let ranges = [(0, 3), (2, 2), (5, 12), (1, 2)];
        let whole = all(
            &ranges,
            ChunkLimits {
                packets: 100,
                packets_of_span: 100,
            },
        );
        assert_eq!(whole.len(), 1);
        let numbers = |chunks: &[Chunk]| {
            let packets = chunks.iter().flat_map(|chunk| &chunk.packets);
            packets
                .map(|p| (p.receiver, p.number, p.begin, p.end))
                .collect::<Vec<_>>()
        };
        for (packets, packets_of_span) in [(1, 100), (4, 2), (5, 3), (3, 1)] {
            let parts = all(
                &ranges,
                ChunkLimits {
                    packets,
                    packets_of_span,
                },
            );
            assert_eq!(numbers(&parts), numbers(&whole));
            for chunk in &parts {
                assert!(chunk.packets.len() <= packets as usize);
                for span in &chunk.spans {
                    assert!(span.packet_count <= packets_of_span);
                    let own =
                        &chunk.packets[span.first_packet as usize..][..span.packet_count as usize];
                    assert!(
                        own.iter()
                            .all(|packet| packet.receiver - 100 == span.result - 10)
                    );
                    let is_first = own
                        .first()
                        .is_none_or(|packet| packet.number == packet.begin);
                    assert_eq!(span.adds == 0, is_first);
                }
            }
            assert_eq!(parts.last().map(|chunk| chunk.done), Some(1.0));
        }
    }
}

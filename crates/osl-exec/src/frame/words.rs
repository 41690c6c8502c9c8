//! The words of a plane, in large pages where the system has them.
//!
//! The system clears a page when it is first written to, which takes microseconds for each page of 4 KiB:
//! more than shading its points, if the shader is simple. It does so for one thread at a time. A large page
//! takes hardly longer.

use super::spare::{self, Memory};
use memmap2::MmapMut;
use std::ops::{Deref, DerefMut};

/// Bytes of a large page.
const PAGE: usize = 2 << 20;
/// The least number of bytes for which a large page is worth its memory.
const LEAST: usize = 1 << 20;

/// Words, one for each point. They behave as a slice.
pub struct Words(Memory);

impl Words {
    /// Words that are 0.
    #[must_use]
    pub fn zeros(count: usize) -> Words {
        let bytes = count.saturating_mul(size_of::<u32>());
        let pages = if bytes >= LEAST { pages(bytes) } else { None };
        Words(pages.map_or_else(|| Memory::Own(vec![0; count]), |pages| Memory::Pages(pages, count)))
    }

    /// Words with any values, which are going to be overwritten.
    #[must_use]
    pub(crate) fn any(count: usize) -> Words {
        match spare::take(count.saturating_mul(size_of::<u32>())) {
            Some(Memory::Own(mut own)) => {
                own.resize(count, 0);
                Words(Memory::Own(own))
            }
            Some(Memory::Pages(pages, _)) => Words(Memory::Pages(pages, count)),
            None => Words::zeros(count),
        }
    }

    /// Makes room for so many words in all, so that they can be appended where they stay.
    pub fn reserve(&mut self, count: usize) {
        let bytes = count.saturating_mul(size_of::<u32>());
        if let Some(mut pages) = (bytes >= LEAST).then(|| pages(bytes)).flatten() {
            let have = self.len();
            if let Some(room) = pages.get_mut(..have * size_of::<u32>()) {
                room.copy_from_slice(bytemuck::cast_slice(self));
                self.0 = Memory::Pages(pages, have);
            }
        }
    }

    /// Appends words.
    pub fn append(&mut self, more: &[u32]) {
        match &mut self.0 {
            Memory::Own(own) => own.extend(more),
            Memory::Pages(pages, count) if pages.len() / size_of::<u32>() - *count >= more.len() => {
                let bytes = *count * size_of::<u32>();
                if let Some(room) = pages.get_mut(bytes..bytes + size_of_val(more)) {
                    room.copy_from_slice(bytemuck::cast_slice(more));
                    *count += more.len();
                }
            }
            Memory::Pages(..) => {
                let mut own = Vec::with_capacity(self.len() + more.len());
                own.extend_from_slice(self);
                own.extend(more);
                self.0 = Memory::Own(own);
            }
        }
    }

    /// The words as single-precision floats.
    #[must_use]
    pub fn as_floats(&self) -> &[f32] {
        bytemuck::cast_slice(self)
    }

    /// The same in a vector. They are not copied unless they are in large pages.
    #[must_use]
    pub fn into_floats(mut self) -> Vec<f32> {
        match &mut self.0 {
            Memory::Own(own) => std::mem::take(own).into_iter().map(f32::from_bits).collect(),
            Memory::Pages(..) => self.as_floats().to_vec(),
        }
    }
}

/// Memory of at least some bytes in large pages; `None` if the system refuses.
#[cfg(target_os = "linux")]
fn pages(bytes: usize) -> Option<MmapMut> {
    let pages = MmapMut::map_anon(bytes.checked_next_multiple_of(PAGE)?).ok()?;
    pages.advise(memmap2::Advice::HugePage).ok()?;
    Some(pages)
}

#[cfg(not(target_os = "linux"))]
fn pages(_: usize) -> Option<MmapMut> {
    None
}

impl AsRef<[f32]> for Words {
    fn as_ref(&self) -> &[f32] {
        self.as_floats()
    }
}

impl Deref for Words {
    type Target = [u32];
    #[inline]
    fn deref(&self) -> &[u32] {
        match &self.0 {
            Memory::Own(own) => own,
            Memory::Pages(pages, count) => {
                bytemuck::cast_slice(pages.get(..count * size_of::<u32>()).unwrap_or_default())
            }
        }
    }
}

impl DerefMut for Words {
    #[inline]
    fn deref_mut(&mut self) -> &mut [u32] {
        match &mut self.0 {
            Memory::Own(own) => own,
            Memory::Pages(pages, count) => {
                bytemuck::cast_slice_mut(pages.get_mut(..*count * size_of::<u32>()).unwrap_or_default())
            }
        }
    }
}

impl Drop for Words {
    fn drop(&mut self) {
        spare::give(std::mem::replace(&mut self.0, Memory::Own(Vec::new())));
    }
}

impl Default for Words {
    fn default() -> Words {
        Words(Memory::Own(Vec::new()))
    }
}

impl Clone for Words {
    fn clone(&self) -> Words {
        self.to_vec().into()
    }
}

impl std::fmt::Debug for Words {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self[..].fmt(f)
    }
}

impl PartialEq for Words {
    fn eq(&self, other: &Words) -> bool {
        self[..] == other[..]
    }
}

impl From<Vec<u32>> for Words {
    fn from(own: Vec<u32>) -> Words {
        Words(Memory::Own(own))
    }
}

impl FromIterator<u32> for Words {
    fn from_iter<T: IntoIterator<Item = u32>>(words: T) -> Words {
        Vec::from_iter(words).into()
    }
}

impl<'a> IntoIterator for &'a Words {
    type Item = &'a u32;
    type IntoIter = std::slice::Iter<'a, u32>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_a_slice_wherever_they_are() {
        for count in [0, 7, LEAST / 4 - 1, LEAST / 4, 3 * PAGE / 4 + 5] {
            let mut words = Words::zeros(count);
            assert_eq!(words.len(), count);
            assert!(words.iter().all(|word| *word == 0));
            words.iter_mut().enumerate().for_each(|(at, word)| *word = at as u32);
            let mut copy = words.clone();
            assert_eq!(copy, words);
            copy.append(&[9]);
            words.append(&[9]);
            assert_eq!((words.len(), words.last()), (count + 1, Some(&9)));
            assert_eq!(copy, words);
            assert_eq!(words.as_floats().len(), count + 1);
            let floats = words.clone().into_floats();
            assert!(floats.iter().map(|x| x.to_bits()).eq(words.iter().copied()));
            copy.reserve(count + PAGE);
            assert_eq!(copy, words);
            copy.append(&words);
            copy.append(&[7]);
            assert_eq!(copy[..], [&words[..], &words[..], &[7]].concat());
        }
    }

    #[test]
    fn words_get_the_memory_of_others() {
        for count in [3, LEAST / 8, LEAST / 4, 3 * PAGE / 4 + 5] {
            let own = |count: usize| {
                let mut words = Words::any(count);
                assert_eq!(words.len(), count);
                words.fill(7);
                words
            };
            // Also if those were longer or shorter, and if several are used at the same time.
            drop([own(count), own(count + 100)]);
            let both = [own(count + 50), own(count)];
            assert!(both.iter().all(|words| words.iter().all(|word| *word == 7)));
            drop(both);
            assert!(Words::zeros(count).iter().all(|word| *word == 0));
        }
    }
}

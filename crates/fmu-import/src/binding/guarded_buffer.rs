//! Provides output buffers for getter functions of FMUs, with guard bytes that detect a write past the end.

/// What stands behind the values: bytes that no FMU writes by chance.
const GUARD: [u8; 64] = *b"what stands here is not the FMU's; it was asked for fewer values";
/// Whether these are still the bytes of the guard. Without a call of `memcmp`, which takes longer than the comparison.
#[inline]
fn is_guard(bytes: &[u8; GUARD.len()]) -> bool {
    let (found, _) = bytes.as_chunks::<WORD>();
    let (guard, _) = GUARD.as_chunks::<WORD>();
    let differs =
        |(one, other): (&[u8; WORD], &[u8; WORD])| u64::from_ne_bytes(*one) ^ u64::from_ne_bytes(*other);
    found.iter().zip(guard).map(differs).fold(0, |all, bits| all | bits) == 0
}

/// How much memory is behind the values, for what comes too much [bytes].
const SPARE: usize = 1 << 15;
const WORD: usize = size_of::<u64>();

/// Memory that an instance lends its FMU. It is kept from call to call.
#[derive(Debug, Default)]
pub(super) struct GuardedBuffer {
    words: Vec<u64>,
    /// Behind so many bytes of values the guard stands already.
    guarded: Option<usize>,
}

impl GuardedBuffer {
    /// An array with these values.
    #[inline]
    pub(super) fn lend_array<T: Copy>(&mut self, values: &[T]) -> *mut T {
        const { assert!(align_of::<T>() <= align_of::<u64>(), "words are aligned enough") };
        let size = size_of_val(values);
        let stands = self.guarded == Some(size);
        if !stands {
            self.reserve_with_guard(size);
        }
        let array = self.words.as_mut_ptr().cast::<T>();
        // SAFETY: there is room for the values and, since that is smaller than what is spare, the guard.
        unsafe {
            match values {
                // A call of `memcpy` takes longer than this.
                [value] => array.write(*value),
                _ => array.copy_from_nonoverlapping(values.as_ptr(), values.len()),
            }
            if !stands {
                array.add(values.len()).cast::<[u8; GUARD.len()]>().write_unaligned(GUARD);
            }
        }
        array
    }

    /// Makes room for so many bytes of values and what is spare; the guard is to stand behind these.
    #[cold]
    fn reserve_with_guard(&mut self, size: usize) {
        let needed = (size + SPARE).div_ceil(WORD);
        if self.words.len() < needed {
            self.words.resize(needed, 0);
        }
        self.guarded = Some(size);
    }

    /// Takes as many values back as were lent; whether the FMU wrote no more.
    ///
    /// # Safety
    /// The array is one of so many values, and each of them is one, whatever the FMU wrote.
    #[inline]
    pub(super) unsafe fn copy_back_and_check_guard<T: Copy>(&mut self, values: &mut [T]) -> bool {
        let array = self.words.as_ptr().cast::<T>();
        // SAFETY: as in `lend_array`.
        let whole = unsafe {
            match values {
                [value] => *value = array.read(),
                _ => array.copy_to_nonoverlapping(values.as_mut_ptr(), values.len()),
            }
            is_guard(&array.add(values.len()).cast::<[u8; GUARD.len()]>().read_unaligned())
        };
        if !whole {
            self.guarded = None;
        }
        whole
    }
}

/// A single value that an FMU fills in, beside others.
#[repr(C)]
pub(super) struct GuardedValue<T> {
    value: T,
    guard: [u8; GUARD.len()],
}

impl<T: AnyBitPattern> GuardedValue<T> {
    pub(super) fn new(value: T) -> Self {
        GuardedValue { value, guard: GUARD }
    }

    /// Where the FMU writes. Also what stands behind the value may be written.
    pub(super) fn value_pointer(&mut self) -> *mut T {
        (&raw mut *self).cast()
    }

    pub(super) fn get(&self) -> T {
        self.value
    }

    /// Whether the FMU wrote the value alone.
    pub(super) fn is_intact(&self) -> bool {
        self.guard == GUARD
    }
}

/// A value that may have any bits.
pub(super) trait AnyBitPattern: Copy {}
macro_rules! plain {
    ($($form:ty)*) => { $(impl AnyBitPattern for $form {})* };
}
plain!(f64 f32 i8 u8 i16 u16 i32 u32 i64 u64 usize super::functions::Fmi3Boolean);
impl<T> AnyBitPattern for *const T {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_too_wide_is_seen() {
        let mut slot = GuardedValue::new(1_u8);
        // SAFETY: there is room for one value, and more.
        unsafe { slot.value_pointer().write(2) };
        assert!(slot.is_intact() && slot.get() == 2);
        // SAFETY: as above.
        unsafe { slot.value_pointer().cast::<u32>().write_unaligned(3) };
        assert!(!slot.is_intact());
    }

    #[test]
    fn what_is_lent_comes_back_and_one_more_value_is_seen() {
        let mut buffer = GuardedBuffer::default();
        for count in [0_u8, 1, 3, 9, 200, 2] {
            let mut values: Vec<u8> = (0..count).collect();
            for written in [count, count + 1] {
                let array = buffer.lend_array(&values);
                for place in 0..written {
                    // SAFETY: there is room for much more.
                    unsafe { array.add(place.into()).write(7) };
                }
                // SAFETY: it was lent with these values.
                assert_eq!(
                    unsafe { buffer.copy_back_and_check_guard(&mut values) },
                    written == count,
                    "{count}"
                );
                assert!(values.iter().all(|value| *value == 7));
            }
        }
    }
}

//! What all structs of the interface have in common.

/// What `struct_size` has beside the size of the struct. Only an `_INIT` macro sets it, so a struct of zeros is refused, even with its size.
pub const CAMLUX_INITIALISED: u32 = 0xca30_0000;

/// The bits of `struct_size` that are the size.
pub(super) const SIZE_BITS: u32 = 0xffff;

/// A struct of the interface. Its default has the values of its `_INIT` macro in the header.
///
/// # Safety
/// It is `repr(C)`, begins with `struct_size: u32` and has no padding. Any bytes are a valid value of it.
#[doc(hidden)]
pub unsafe trait CStruct: Copy + Default {
    const NAME: &'static str;
    /// Its size in the first version of the interface, whatever was added since.
    const VERSION_1_BYTES: usize;
}

/// Implements [`CStruct`] for a struct: its name, its bytes in version 1, and the initial values of members that are not 0.
macro_rules! c_struct {
    ($name:ident, $version_1_bytes:literal $(, $field:ident: $first:expr)* $(,)?) => {
        // SAFETY: repr(C), the size first, then numbers and pointers (function pointers may be null) without padding. The tests of
        // the header check this for every struct.
        unsafe impl CStruct for $name {
            const NAME: &'static str = stringify!($name);
            const VERSION_1_BYTES: usize = $version_1_bytes;
        }

        impl Default for $name {
            fn default() -> Self {
                $name {
                    struct_size: CAMLUX_INITIALISED | size_of::<Self>() as u32,
                    $($field: $first,)*
                    // SAFETY: any bytes are a valid value.
                    ..unsafe { std::mem::zeroed() }
                }
            }
        }
    };
}
pub(super) use c_struct;

//! What all structs of the interface have in common.

/// A struct of the interface. Its default is what its `_INIT` macro in the header has.
///
/// # Safety
/// It is `repr(C)`, begins with `struct_size: u32`, has no padding, and any bytes are a value of it.
#[doc(hidden)]
pub unsafe trait CStruct: Copy + Default {
    const NAME: &'static str;
    /// Its size in the first version of the interface, whatever was added since.
    const VERSION_1_BYTES: usize;
}

/// A struct of the interface: its name, its bytes in version 1, and the first values of the members that do not begin as 0.
macro_rules! c_struct {
    ($name:ident, $version_1_bytes:literal $(, $field:ident: $first:expr)* $(,)?) => {
        // SAFETY: repr(C), the size first, numbers and pointers (a function's may be null) without padding: the tests of
        // the header hold all of them to it.
        unsafe impl CStruct for $name {
            const NAME: &'static str = stringify!($name);
            const VERSION_1_BYTES: usize = $version_1_bytes;
        }

        impl Default for $name {
            fn default() -> Self {
                $name {
                    struct_size: size_of::<Self>() as u32,
                    $($field: $first,)*
                    // SAFETY: any bytes are a value of it.
                    ..unsafe { std::mem::zeroed() }
                }
            }
        }
    };
}
pub(super) use c_struct;

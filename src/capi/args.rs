//! Reads the arguments of a C program. Every pointer is checked as far as possible. The caller guarantees that it points to what it
//! should, which is why the functions here are unsafe.

use std::{
    ffi::{CStr, c_char, c_void},
    path::Path,
    ptr,
};

use super::*;

/// Elements of an array in the host's memory.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_array {
    /// The first element. It must be aligned to the size of a component: 8 bytes for CAMLUX_FORMAT_F64, and so on.
    pub data: *const c_void,
    /// Bytes from one element to the next, a multiple of the size of a component; 0: the elements are contiguous.
    pub stride_bytes: usize,
    /// Format of the components: CAMLUX_FORMAT_F32 and so on.
    pub format: i32,
    /// 0.
    pub reserved: u32,
}

/// Components are 32-bit floating-point numbers.
pub const CAMLUX_FORMAT_F32: i32 = 1;
/// Components are 64-bit floating-point numbers.
pub const CAMLUX_FORMAT_F64: i32 = 2;
/// Components are 16-bit unsigned integers.
pub const CAMLUX_FORMAT_U16: i32 = 3;
/// Components are 32-bit unsigned integers.
pub const CAMLUX_FORMAT_U32: i32 = 4;

impl camlux_array {
    pub(super) const fn none(format: i32) -> Self {
        camlux_array {
            data: ptr::null(),
            stride_bytes: 0,
            format,
            reserved: 0,
        }
    }
}

/// Largest accepted size: a struct from a newer header may be longer than here.
const LONGEST_STRUCT_BYTES: usize = 4096;

pub(super) fn check_pointer<T>(pointer: *const T, name: &str) -> Outcome {
    if pointer.is_null() {
        return Err(Failure::argument(format!("{name} is NULL")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::argument(format!(
            "{name} is {pointer:p}, which is not aligned to {} bytes",
            align_of::<T>()
        )));
    }
    Ok(())
}

/// # Safety
/// If `pointer` is not null and is aligned, it points to the first four bytes of the struct.
pub(super) unsafe fn struct_bytes<T: CStruct>(pointer: *const T) -> Outcome<usize> {
    check_pointer(pointer, T::NAME)?;
    // SAFETY: the caller guarantees it; a struct begins with its size.
    let struct_size = unsafe { pointer.cast::<u32>().read() };
    let bytes = (struct_size & SIZE_BITS) as usize;
    let is_initialised = struct_size & !SIZE_BITS == CAMLUX_INITIALISED;
    if is_initialised && (T::VERSION_1_BYTES..=LONGEST_STRUCT_BYTES).contains(&bytes) {
        return Ok(bytes);
    }
    let (name, macro_prefix) = (T::NAME, T::NAME.to_uppercase());
    Err(Failure::argument(format!(
        "the {name} is not initialised: its struct_size is {struct_size:#x}; begin with {macro_prefix}_INIT, which sets struct_size and all first values"
    )))
}

/// Checks that a struct can be read or written.
///
/// # Safety
/// If `pointer` is not null and is aligned, it points to the first four bytes of the struct.
pub(super) unsafe fn check_struct<T: CStruct>(pointer: *const T) -> Outcome {
    // SAFETY: the caller guarantees it.
    unsafe { struct_bytes(pointer) }.map(drop)
}

/// Reads a struct of any version. Members that an older program lacks have their defaults. Members that only a newer program has
/// must be 0.
///
/// # Safety
/// `pointer` is null, or misaligned, or points to as many bytes as its `struct_size` says.
pub(super) unsafe fn read<T: CStruct>(pointer: *const T) -> Outcome<T> {
    // SAFETY: the caller guarantees it.
    let bytes = unsafe { struct_bytes(pointer) }?;
    let known = bytes.min(size_of::<T>());
    let mut value = T::default();
    // SAFETY: the caller guarantees what is read; `value` has room for it, and any bytes are a valid value.
    let beyond = unsafe {
        ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut value).cast(), known);
        std::slice::from_raw_parts(pointer.cast::<u8>().add(known), bytes - known)
    };
    if beyond.iter().any(|&byte| byte != 0) {
        return Err(Failure::argument(format!(
            "{} has {bytes} bytes, but this camlux knows only the first {known}, and others are not 0: the program was built for a newer camlux; \
             install that version, or set the new members to 0",
            T::NAME
        )));
    }
    Ok(value)
}

/// As [`read`], for a struct that may be left out.
///
/// # Safety
/// As for [`read`].
pub(super) unsafe fn read_optional<T: CStruct>(pointer: *const T) -> Outcome<Option<T>> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller guarantees it.
    unsafe { read(pointer) }.map(Some)
}

/// Reads `count` structs, `stride_bytes` apart.
///
/// # Safety
/// `first` is null, or misaligned, or points to `count` structs of that stride, each as for [`read`].
pub(super) unsafe fn read_many<T: CStruct, U>(
    first: *const T,
    count: usize,
    stride_bytes: usize,
    convert: impl Fn(T) -> Outcome<U>,
) -> Outcome<Vec<U>> {
    let name = T::NAME.trim_start_matches("camlux_");
    let rows = Rows {
        name: &format!("{name}s"),
        count_name: "count",
        data: first.cast(),
        stride_bytes,
        count,
        length: T::VERSION_1_BYTES / size_of::<u64>(),
    };
    if count > 0 && stride_bytes == 0 {
        let problem = format!("stride_bytes is 0; give sizeof({})", T::NAME);
        return Err(Failure::argument(problem));
    }
    let places = rows.places::<u64>()?.into_iter().enumerate();
    let read = places.map(|(place, at)| {
        // SAFETY: the caller guarantees it.
        let value = unsafe { read(at.cast::<T>()) }.and_then(&convert);
        value.map_err(|error| error.within(&format!("{name} {place}")))
    });
    read.collect()
}

/// Writes as much of a struct as the host's has room for, except `struct_size`. The pointer is checked before `make` runs.
///
/// # Safety
/// As for [`read`], and the bytes are writable.
pub(super) unsafe fn write<T: CStruct>(
    pointer: *mut T,
    make: impl FnOnce() -> Outcome<T>,
) -> Outcome {
    // SAFETY: the caller guarantees it.
    let bytes = unsafe { struct_bytes(pointer) }?;
    let value = make()?;
    let known = bytes.min(size_of::<T>());
    let kept = size_of::<u32>();
    // SAFETY: both have this many bytes; they cannot overlap, because `value` is local.
    unsafe {
        let from = (&raw const value).cast::<u8>().add(kept);
        ptr::copy_nonoverlapping(from, pointer.cast::<u8>().add(kept), known - kept);
    }
    Ok(())
}

/// Writes a struct, if there is one, and whether there is one.
///
/// # Safety
/// As for [`write`]; `is_set` is null, or misaligned, or writable.
pub(super) unsafe fn write_optional<T: CStruct>(
    pointer: *mut T,
    is_set: *mut i32,
    value: Option<T>,
) -> Outcome {
    // SAFETY: the caller guarantees it.
    unsafe {
        struct_bytes(pointer)?;
        write_result(is_set, "is_set", || Ok(value.is_some().into()))?;
        value.map_or(Ok(()), |value| write(pointer, || Ok(value)))
    }
}

/// Writes a result to the host's memory. The pointer is checked before `make` runs.
///
/// # Safety
/// `out` is null, or misaligned, or writable.
pub(super) unsafe fn write_result<T>(
    out: *mut T,
    name: &str,
    make: impl FnOnce() -> Outcome<T>,
) -> Outcome {
    check_pointer(out, name)?;
    let result = make()?;
    // SAFETY: checked above as far as possible; the caller guarantees the rest.
    unsafe { out.write(result) };
    Ok(())
}

/// Reads a text of the host; `None` if it is NULL.
///
/// # Safety
/// `pointer` is null or points to bytes that end with a 0.
pub(super) unsafe fn text(pointer: *const c_char, name: &str) -> Outcome<Option<String>> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller guarantees it.
    let text = unsafe { CStr::from_ptr(pointer) }.to_str();
    let wrong = |error| {
        Failure::argument(format!(
            "{name} is not valid UTF-8: {error}; convert it to UTF-8"
        ))
    };
    Ok(Some(text.map_err(wrong)?.to_owned()))
}

/// Reads a path, which must not be NULL or empty.
///
/// # Safety
/// As for [`text`].
pub(super) unsafe fn path(pointer: *const c_char) -> Outcome<String> {
    // SAFETY: the caller guarantees it.
    match unsafe { text(pointer, "path") }? {
        Some(path) if !path.is_empty() => Ok(path),
        Some(_) => Err(Failure::argument("path is empty")),
        None => Err(Failure::argument("path is NULL")),
    }
}

/// Reads the path of a file to write, whose name must end with the extension of its format.
///
/// # Safety
/// As for [`text`].
pub(super) unsafe fn output_path(pointer: *const c_char, extension: &str) -> Outcome<String> {
    // SAFETY: the caller guarantees it.
    let path = unsafe { path(pointer) }?;
    let own = Path::new(&path).extension();
    if own.is_some_and(|own| own.eq_ignore_ascii_case(extension)) {
        return Ok(path);
    }
    Err(Failure::argument(format!(
        "path is {path}, and the file would not be what its name says; end it with .{extension}"
    )))
}

/// Constants, each with its name and its value in Rust.
macro_rules! choices {
    ($($constant:ident => $choice:expr),* $(,)?) => {
        [$(($constant, stringify!($constant), $choice)),*]
    };
}
pub(super) use choices;

/// Finds the value of a constant; `what` names the argument.
pub(super) fn one_of<T: Clone>(what: &str, value: i32, choices: &[(i32, &str, T)]) -> Outcome<T> {
    let found = choices.iter().find(|(number, ..)| *number == value);
    found.map(|(.., choice)| choice.clone()).ok_or_else(|| {
        let name = |(number, name, _): &(i32, &str, T)| format!("{name} ({number})");
        let names: Vec<String> = choices.iter().map(name).collect();
        let names = names.join(", ");
        Failure::argument(format!("{what} is {value}; give one of {names}"))
    })
}

pub(super) fn flag(what: &str, value: i32) -> Outcome<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Failure::argument(format!("{what} is {value}; give 0 or 1"))),
    }
}

pub(super) fn reserved(what: &str, value: u32) -> Outcome {
    if value == 0 {
        return Ok(());
    }
    let problem = format!("{what} has {value} in a reserved member; leave it 0");
    Err(Failure::argument(problem))
}

/// Rows of components in the host's memory.
pub(super) struct Rows<'n> {
    pub name: &'n str,
    /// The argument or member that has the count.
    pub count_name: &'n str,
    pub data: *const c_void,
    /// Bytes from one row to the next; 0: contiguous.
    pub stride_bytes: usize,
    pub count: usize,
    /// Components of a row.
    pub length: usize,
}

impl Rows<'_> {
    /// Converts every row by `convert`, in order.
    ///
    /// # Safety
    /// `data` is null, or misaligned, or points to all the rows; any bytes are a valid `C`.
    pub unsafe fn read<C, T>(&self, convert: impl Fn(&[C]) -> T) -> Outcome<Vec<T>> {
        if self.count == 0 || self.length == 0 {
            return Ok(Vec::new());
        }
        let stride_bytes = self.checked_stride::<C>()?;
        let mut values = room_for(self.count, self.name)?;
        values.extend((0..self.count).map(|row| {
            // SAFETY: the product does not overflow and the address is aligned; the caller guarantees that the row exists.
            convert(unsafe {
                let start = self.data.cast::<u8>().add(row * stride_bytes);
                std::slice::from_raw_parts(start.cast::<C>(), self.length)
            })
        }));
        Ok(values)
    }

    /// The address of each row, aligned for a `C`.
    pub fn places<C>(&self) -> Outcome<Vec<*const C>> {
        if self.count == 0 {
            return Ok(Vec::new());
        }
        let stride_bytes = self.checked_stride::<C>()?;
        let mut places = room_for(self.count, self.name)?;
        let place = |row| self.data.cast::<u8>().wrapping_add(row * stride_bytes);
        places.extend((0..self.count).map(|row| place(row).cast()));
        Ok(places)
    }

    /// Bytes from one row to the next, checked: all rows fit in the address space.
    fn checked_stride<C>(&self) -> Outcome<usize> {
        let (name, count, size) = (self.name, self.count, size_of::<C>());
        let count_name = self.count_name;
        let wrong = |problem: String| Err(Failure::argument(problem));
        if self.data.is_null() {
            return wrong(format!(
                "{name} is NULL, but {count_name} is {count}; give the array, or set {count_name} to 0"
            ));
        }
        check_pointer(self.data.cast::<C>(), name)?;
        let Some(tight_bytes) = self.length.checked_mul(size) else {
            return wrong(format!(
                "a row of {name} has {} components, more than memory can hold; check their number",
                self.length
            ));
        };
        let stride_bytes = match self.stride_bytes {
            0 => tight_bytes,
            stride_bytes => stride_bytes,
        };
        if stride_bytes < tight_bytes || stride_bytes % size != 0 {
            return wrong(format!(
                "the stride of {name} is {stride_bytes} bytes; give 0, or a multiple of {size} of at least {tight_bytes}"
            ));
        }
        let end = count
            .checked_mul(stride_bytes)
            .filter(|&bytes| bytes <= isize::MAX as usize)
            .and_then(|bytes| self.data.addr().checked_add(bytes));
        if end.is_none() {
            return wrong(format!(
                "{count} elements of {name}, {stride_bytes} bytes apart, are more than memory can hold; check {count_name}"
            ));
        }
        Ok(stride_bytes)
    }
}

/// An empty list with room for `count` values.
pub(super) fn room_for<T>(count: usize, what: &str) -> Outcome<Vec<T>> {
    let mut values = Vec::new();
    let reserved = values.try_reserve_exact(count);
    reserved.map_err(|_| {
        let problem = format!("there is no memory for {count} {what}; give fewer");
        Failure::new(CAMLUX_ERROR_OUT_OF_MEMORY, problem)
    })?;
    Ok(values)
}

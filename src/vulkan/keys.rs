//! The macros in which `build.rs` writes what it knows of `shaders/`: axes, keys, structs, and the module of each key.

/// A choice among flags of a permutation.
pub(crate) trait Axis: Copy {
    /// The chosen flags. `field` is the flag of an axis that is on or off.
    fn flags(self, field: &'static str) -> Vec<&'static str>;

    #[cfg(test)]
    fn all() -> Vec<Self>;
}

impl Axis for bool {
    fn flags(self, field: &'static str) -> Vec<&'static str> {
        self.then_some(field).into_iter().collect()
    }

    #[cfg(test)]
    fn all() -> Vec<Self> {
        vec![false, true]
    }
}

impl<A: Axis> Axis for Option<A> {
    fn flags(self, field: &'static str) -> Vec<&'static str> {
        self.map_or(Vec::new(), |choice| choice.flags(field))
    }

    #[cfg(test)]
    fn all() -> Vec<Self> {
        let some = A::all().into_iter().map(Some);
        [None].into_iter().chain(some).collect()
    }
}

/// Enums of the named axes.
macro_rules! axes {
    ($($axis:ident { $($choice:ident $flags:literal),* })*) => {$(
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $axis { $($choice),* }

        impl Axis for $axis {
            fn flags(self, _: &'static str) -> Vec<&'static str> {
                let flags = match self { $($axis::$choice => $flags),* };
                flags.split(' ').collect()
            }

            #[cfg(test)]
            fn all() -> Vec<Self> {
                vec![$($axis::$choice),*]
            }
        }
    )*};
}

/// The enum of all kernels: a variant for each line of the file.
macro_rules! keys {
    ($($key:ident { $($field:ident: $axis:ty,)* })*) => {
        /// A kernel of a pass, with a choice on each of its axes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Key { $($key { $($field: $axis),* }),* }

        impl Key {
            /// The flags that are chosen, in the order of the axes.
            fn flags(self) -> Vec<&'static str> {
                match self {$(
                    Key::$key { $($field),* } => {
                        let flags: [Vec<&'static str>; _] = [$($field.flags(stringify!($field))),*];
                        flags.concat()
                    }
                )*}
            }

            #[cfg(test)]
            pub fn all() -> Vec<Key> {
                let mut all = Vec::new();
                $(keys!(@all all $key () $($field: $axis,)*);)*
                all
            }
        }
    };
    (@all $all:ident $key:ident ($($chosen:ident)*)) => {
        $all.push(Key::$key { $($chosen),* })
    };
    (@all $all:ident $key:ident ($($chosen:ident)*) $field:ident: $axis:ty, $($rest:tt)*) => {
        for $field in <$axis>::all() {
            keys!(@all $all $key ($($chosen)* $field) $($rest)*);
        }
    };
}

/// Lists of bindings, which modules of a pass share.
macro_rules! bindings {
    ($($list:ident = [$($binding:literal $name:literal $kind:ident,)*];)*) => {$(
        static $list: &[Binding] =
            &[$(Binding { binding: $binding, name: $name, kind: DescriptorType::$kind }),*];
    )*};
}

/// The structs that host and shaders share, with their sizes in bytes.
macro_rules! structs {
    ($($name:ident $bytes:literal { $($member:ident: $of:ty,)* })*) => {$(
        #[repr(C)]
        #[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
        pub struct $name { $(pub $member: $of),* }

        // `Pod` has no padding of its own, so the size shows that all members are in their places.
        const _: () = assert!(size_of::<$name>() == $bytes);
    )*};
}

/// The modules, each with the keys that it serves.
macro_rules! modules {
    ($($module:ident: $keys:pat => $name:literal $pass:literal $entry:literal $workgroup_size:tt $immediate_bytes:literal $bindings:ident
       $switches:tt $constants:tt;)*) => {
        $(static $module: Module = Module {
            name: $name,
            pass: $pass,
            switches: &$switches,
            entry: $entry,
            workgroup_size: $workgroup_size,
            immediate_bytes: $immediate_bytes,
            bindings: $bindings,
            constants: &$constants,
            spirv: include_bytes!(concat!(env!("CAMLUX_SPIRV"), "/", $name, ".spv")),
        };)*

        /// Every compiled module, sorted as in `shaders/permutations.txt`.
        pub static MODULES: &[&Module] = &[$(&$module),*];

        impl Key {
            /// The module from which the kernel is made.
            pub fn module(self) -> &'static Module {
                match self { $($keys => &$module),* }
            }
        }
    };
}

pub(super) use {axes, bindings, keys, modules, structs};

//! One name for each effect of a list, and its equations behind it.

/// Makes an enum of effects out of their modules; the same for the muscle's here and for the bench's on the host.
#[macro_export]
macro_rules! effect_list {
    ($(#[$outer:meta])* $name:ident: $($(#[$doc:meta])* $variant:ident = $module:ident;)+) => {
        $(#[$outer])*
        pub enum $name {
            $($(#[$doc])* $variant,)+
        }

        impl $name {
            /// All of them, in order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// What it is.
            pub const fn info(self) -> &'static $crate::effects::Info {
                match self {
                    $(Self::$variant => &<$module::$variant as $crate::effects::Effect>::INFO,)+
                }
            }

            /// Lets time pass in its memory.
            pub fn step<T: $crate::scalar::Scalar>(
                self,
                parameters: &[T],
                context: &$crate::effects::Context<T>,
                memory: &mut $crate::effects::Memory<T>,
            ) {
                match self {
                    $(Self::$variant =>
                        <$module::$variant as $crate::effects::Effect>::step(parameters, context, memory),)+
                }
            }

            /// The force it adds, N.
            pub fn force<T: $crate::scalar::Scalar>(
                self,
                parameters: &[T],
                context: &$crate::effects::Context<T>,
                memory: &$crate::effects::Memory<T>,
            ) -> T {
                match self {
                    $(Self::$variant =>
                        <$module::$variant as $crate::effects::Effect>::force(parameters, context, memory),)+
                }
            }

            /// The effect of this catalogue name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|e| e.info().name == name)
            }
        }
    };
}

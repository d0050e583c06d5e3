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

            /// What a diagnosis has to know of it.
            pub const fn traits(self) -> &'static $crate::effects::Traits {
                match self {
                    $(Self::$variant => &<$module::$variant as $crate::effects::Effect>::TRAITS,)+
                }
            }

            // What a controller needs of an effect, separate from its description: a program that uses nothing else contains none
            // of the texts.

            /// How many parameters it has.
            pub const fn parameter_count(self) -> usize {
                match self {
                    $(Self::$variant =>
                        const { <$module::$variant as $crate::effects::Effect>::INFO.parameters.len() },)+
                }
            }

            /// Whether its force depends on the pressure: [`Info::depends_on_pressure`]($crate::effects::Info::depends_on_pressure).
            pub const fn depends_on_pressure(self) -> bool {
                match self {
                    $(Self::$variant =>
                        const { <$module::$variant as $crate::effects::Effect>::INFO.depends_on_pressure },)+
                }
            }

            /// Whether its memory has to survive a power cycle: [`Info::persistent`]($crate::effects::Info::persistent).
            pub const fn is_persistent(self) -> bool {
                match self {
                    $(Self::$variant =>
                        const { <$module::$variant as $crate::effects::Effect>::INFO.persistent },)+
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

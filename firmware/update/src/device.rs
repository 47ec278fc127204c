//! A charger's checks of a container, in order.

use firmware::charger::{Installation, MeterFacts, misfits};
use firmware::frequency::filter::Filter;
use firmware::table::TableView;

use crate::class::DeviceClass;
use crate::container::Container;
use crate::key::{Verify, authentic};
use crate::refusal::Refusal;

/// What a charger holds a container against.
#[derive(Debug, Clone, Copy)]
pub struct Device<K> {
    /// Who is believed.
    pub trusted: K,
    /// What kind of charger it is.
    pub class: DeviceClass,
    /// What it was built and configured as.
    pub installation: Installation,
    /// What its meter says of itself.
    pub meter: MeterFacts,
    /// Ticks of the moving average over its readings.
    pub filter_ticks: u8,
}

impl<K: Verify> Device<K> {
    /// Whether the charger could run this container's table: signature, class, the table's reader,
    /// and what its proof assumed of a charger. Asked before a container is installed and at every
    /// start.
    ///
    /// # Errors
    /// [`Refusal::BadSignature`], [`Refusal::WrongClass`], [`Refusal::Table`],
    /// [`Refusal::Misfit`]; the first that applies.
    pub fn runs(&self, container: &Container<'_>) -> Result<(), Refusal> {
        if !authentic(container, &self.trusted) {
            return Err(Refusal::BadSignature);
        }
        self.is_for(container.header.class)?;
        let table = TableView::parse(container.table).map_err(Refusal::Table)?;
        let filter = Filter::new(self.filter_ticks);
        let found = misfits(&table.header(), &self.installation, self.meter, &filter);
        if found.is_empty() {
            Ok(())
        } else {
            Err(Refusal::Misfit(found))
        }
    }

    /// Whether the class is this charger's.
    ///
    /// # Errors
    /// [`Refusal::WrongClass`].
    pub fn is_for(&self, found: DeviceClass) -> Result<(), Refusal> {
        let own = self.class;
        if found == own {
            Ok(())
        } else {
            Err(Refusal::WrongClass { found, own })
        }
    }
}

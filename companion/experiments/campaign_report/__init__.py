"""From a campaign's rows to what they say: who tracked, what breaks it, what hurts most."""

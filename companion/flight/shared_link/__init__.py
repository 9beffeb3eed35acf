"""The vehicle's link, shared with ground stations and other clients."""

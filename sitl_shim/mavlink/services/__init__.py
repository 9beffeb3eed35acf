"""MAVLink's microservices, one module each, and the dispatcher that leads messages to them."""

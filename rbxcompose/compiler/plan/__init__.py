"""What `up` must do: instances in start order, their process groups and wires."""
